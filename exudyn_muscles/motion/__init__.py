"""The motion that is to be followed: q_d(t), q_d'(t), q_d''(t)."""

from .checks import check_motion, warn_of_angles
from .coordinate import Coordinate
from .low_pass import LowPass
from .motion import Motion

__all__ = ["Coordinate", "LowPass", "Motion", "check_motion", "warn_of_angles"]
