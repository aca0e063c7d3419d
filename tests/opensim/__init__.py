"""Where the numbers of OpenSim 4.6 are: those for this project's own models in
`reference/opensim`, those for OpenSim's models beside this repository, of which they are no part.
"""

from pathlib import Path

import pytest

from ..own_models import FOLDER, OWN

REFERENCE = Path(__file__).parents[3] / "shared" / "opensim" / "reference"
ABSENT = "OpenSim's reference files are not beside this repository"

needs_opensim_files = pytest.mark.skipif(not REFERENCE.is_dir(), reason=ABSENT)


def numbers_of(name, kind):
    """The file with OpenSim's numbers for a model, such as `arm` and `static.npz`."""
    return (FOLDER if name in OWN else REFERENCE) / f"{name}_{kind}"


def with_opensims(own, others):
    """Parameters of a test: this project's models, and OpenSim's where they are."""
    return [*own, *(pytest.param(name, marks=needs_opensim_files) for name in others)]
