"""What windows ask for memory."""

import numpy as np

import exudyn_muscles as em
from exudyn_muscles.muscle.course import MAX_STEPS
from exudyn_muscles.recruitment import windows
from models import planar_arm


def test_room_for_more_steps_is_made_where_it_is_needed(monkeypatch):
    """With the same bits as if it had been there from the beginning."""
    model, motion = planar_arm.build(), planar_arm.motion()
    motion = motion.between(motion.start, motion.start + 0.2)
    made, original = [], windows.Windows.make_room
    monkeypatch.setattr(windows.Windows, "make_room", lambda self: made.append(1) or original(self))
    usual = em.cosimulate(model, motion)
    assert not made
    monkeypatch.setattr(windows, "USUAL_STEPS", 4)
    grown = em.cosimulate(model, motion)
    assert made
    for name in ("coordinates", "excitation_values", "tendon_forces"):
        np.testing.assert_array_equal(getattr(grown, name), getattr(usual, name))


def test_usual_windows_have_little_room():
    """Of a hundred muscles half a megabyte, whose first use is not noticed."""
    assert windows.USUAL_STEPS < 0.05 * MAX_STEPS
