"""What people do with a result: pure functions of a model and a trajectory, each returns a `Table`
of named columns with units."""

from ..joints import joint_names
from ..skeleton.joints import JointFrame
from .emg import EMG, Agreement, compare_emg
from .feasible import feasible_forces
from .heat import Bhargava, EnergyLaw, Umberger
from .joint_loads import joint_loads
from .metabolics import Tissue, metabolic_power
from .muscles import muscle_analysis
from .power import power, work
from .sensitivity import Sensitivity, recruitment_sensitivity
from .table import Table

__all__ = [
    "EMG",
    "Agreement",
    "Bhargava",
    "EnergyLaw",
    "JointFrame",
    "Sensitivity",
    "Table",
    "Tissue",
    "Umberger",
    "compare_emg",
    "feasible_forces",
    "joint_loads",
    "joint_names",
    "metabolic_power",
    "muscle_analysis",
    "power",
    "recruitment_sensitivity",
    "work",
]
