"""What people do with a result: pure functions of a model and a trajectory, each returns a `Table`
of named columns with units."""

from .emg import EMG, Agreement, compare_emg
from .feasible import feasible_forces
from .muscles import muscle_analysis
from .power import power, work
from .sensitivity import Sensitivity, recruitment_sensitivity
from .table import Table

__all__ = [
    "EMG",
    "Agreement",
    "Sensitivity",
    "Table",
    "compare_emg",
    "feasible_forces",
    "muscle_analysis",
    "power",
    "recruitment_sensitivity",
    "work",
]
