"""What people do with a result: pure functions of a model and a trajectory, each returns a `Table`
of named columns with units."""

from ..joints import joint_names
from ..skeleton.joints import JointFrame
from .emg import EMG, Agreement, compare_emg
from .feasible import feasible_forces
from .joint_loads import joint_loads
from .muscles import muscle_analysis
from .power import power, work
from .sensitivity import Sensitivity, recruitment_sensitivity
from .table import Table

__all__ = [
    "EMG",
    "Agreement",
    "JointFrame",
    "Sensitivity",
    "Table",
    "compare_emg",
    "feasible_forces",
    "joint_loads",
    "joint_names",
    "muscle_analysis",
    "power",
    "recruitment_sensitivity",
    "work",
]
