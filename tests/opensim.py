"""Where the numbers computed with OpenSim 4.6 are; they are not part of this repository."""

from pathlib import Path

import pytest

REFERENCE = Path(__file__).parents[2] / "shared" / "opensim" / "reference"

needs_opensim_files = pytest.mark.skipif(
    not REFERENCE.is_dir(), reason="OpenSim's reference numbers are not beside this repository"
)
