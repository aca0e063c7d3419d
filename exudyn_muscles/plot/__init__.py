"""Figures of results and of muscles."""

from .analyses import joint_loads
from .fibers import muscle
from .laws import curves
from .trajectories import activations, comparison, excitations, forces, tracking_errors

__all__ = [
    "activations",
    "comparison",
    "curves",
    "excitations",
    "forces",
    "joint_loads",
    "muscle",
    "tracking_errors",
]
