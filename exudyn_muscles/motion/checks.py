"""What is asked of a motion before it is followed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import MotionError, MotionWarning, warn
from .motion import Motion
from .plausibility import doubtful_angles

SAMPLES = 1001  # at which the angles are looked at


def check_motion(motion: Motion, coordinates: Sequence[str]) -> None:
    """Raise MotionError unless the motion is one and has one column for every coordinate."""
    if not isinstance(motion, Motion):
        raise MotionError(f"expected a Motion, got {type(motion).__name__}")
    if len(motion) != len(coordinates):
        raise MotionError(
            f"the motion has {len(motion)} coordinates, the model {len(coordinates)}: "
            f"{', '.join(coordinates)}"
        )


def warn_of_angles(motion: Motion, names: Sequence[str], units: Sequence[str]) -> None:
    """Warn of angles that cannot be radians; those of a file were looked at when it was read.

    Warns
    -----
    MotionWarning
        Names the coordinate and its values.
    """
    if motion.source is None:
        t = np.linspace(motion.start, motion.end, SAMPLES)
        for text in doubtful_angles(t, motion(t)[0], names, units, {}):
            warn(f"the motion's {text} np.radians converts them", MotionWarning)
