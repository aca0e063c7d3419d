"""Muscle-driven forward dynamics and the muscle recruitment problem, as a plugin for Exudyn."""

from importlib.metadata import version

from . import plot, view
from .errors import (
    DisplayError,
    ExudynMusclesError,
    ExudynMusclesWarning,
    FrozenBodiesWarning,
    IncompleteRunWarning,
    ModelError,
    MotionError,
    ParameterError,
    PathWarning,
    RecruitmentError,
    ResultFileError,
    SimulationError,
    StabilityWarning,
    StartWarning,
    UnmetTorqueError,
    UnmetTorqueWarning,
    WindowError,
)
from .methods.cmc import CMC, CMCPlugin, computed_muscle_control
from .methods.control import RecruitmentSettings
from .methods.cosimulation import (
    Cosimulation,
    CosimulationPlugin,
    FirstIterate,
    Predictor,
    Scheme,
    cosimulate,
)
from .methods.forward import Forward, ForwardPlugin, forward_dynamics
from .methods.static import Static, static_optimization
from .model import MusculoskeletalModel
from .motion import Motion
from .muscle.contraction import contraction_rate, equilibrium
from .muscle.parameters import Muscle, MuscleSet
from .muscle.window import WindowEnd, integrate_window
from .path.points import PathPoint
from .recruitment.normalizers import MaximumIsometricForce, Normalizer, ReachableMaximum
from .recruitment.optimization import Reserve, Solver
from .result import Counts, Difference, Excitations, Status, Trajectory

__version__ = version("exudyn_muscles")

__all__ = [
    "CMC",
    "CMCPlugin",
    "Cosimulation",
    "CosimulationPlugin",
    "Counts",
    "Difference",
    "DisplayError",
    "Excitations",
    "ExudynMusclesError",
    "ExudynMusclesWarning",
    "FirstIterate",
    "Forward",
    "ForwardPlugin",
    "FrozenBodiesWarning",
    "IncompleteRunWarning",
    "MaximumIsometricForce",
    "ModelError",
    "Motion",
    "MotionError",
    "Muscle",
    "MuscleSet",
    "MusculoskeletalModel",
    "Normalizer",
    "ParameterError",
    "PathPoint",
    "PathWarning",
    "Predictor",
    "ReachableMaximum",
    "RecruitmentError",
    "RecruitmentSettings",
    "Reserve",
    "ResultFileError",
    "Scheme",
    "SimulationError",
    "Solver",
    "StabilityWarning",
    "StartWarning",
    "Static",
    "Status",
    "Trajectory",
    "UnmetTorqueError",
    "UnmetTorqueWarning",
    "WindowEnd",
    "WindowError",
    "computed_muscle_control",
    "contraction_rate",
    "cosimulate",
    "equilibrium",
    "forward_dynamics",
    "integrate_window",
    "plot",
    "static_optimization",
    "view",
]
