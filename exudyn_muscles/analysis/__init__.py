"""What people do with a result: pure functions of a model and a trajectory, each returns a `Table`
of named columns with units."""

from .feasible import feasible_forces
from .muscles import muscle_analysis
from .power import power, work
from .sensitivity import Sensitivity, recruitment_sensitivity
from .table import Table

__all__ = [
    "Sensitivity",
    "Table",
    "feasible_forces",
    "muscle_analysis",
    "power",
    "recruitment_sensitivity",
    "work",
]
