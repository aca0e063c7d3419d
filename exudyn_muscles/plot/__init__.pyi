from .analyses import joint_loads
from .fibers import muscle
from .indices import indices
from .laws import curves
from .trajectories import activations, comparison, excitations, forces, tracking_errors

__all__ = [
    "activations",
    "comparison",
    "curves",
    "excitations",
    "forces",
    "indices",
    "joint_loads",
    "muscle",
    "tracking_errors",
]
