"""Passive forces of a published model whose rectus femoris is too short for its skeleton."""

import warnings

import numpy as np
import pytest

import exudyn_muscles as em

from ..opensim import REFERENCE

WALK = REFERENCE.parent / "emg18"


@pytest.mark.skipif(not WALK.is_dir(), reason="no published walk in ../shared/opensim/emg18")
def test_a_muscle_that_bears_more_than_it_is_strong_is_named():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", em.ModelFileWarning)
        model = em.opensim.load_model(
            WALK / "subject_walk_armless_18musc.osim", external_loads=WALK / "external_loads.xml"
        )
    motion = em.Motion.from_file(
        WALK / "coordinates.mot", model.coordinates, model.skeleton.units, cutoff=6.0
    )
    q = motion(np.linspace(motion.start, motion.end, 101))[0]
    with pytest.warns(em.PassiveForceWarning, match="recfem_r .* times its max_isometric_force"):
        model.check_lengths(q)
    relieved = em.operators.ignore_passive_fiber_forces(model.muscles)
    model.replace(muscles=relieved).check_lengths(q)
