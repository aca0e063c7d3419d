"""Where the public names are, for type checkers and for `__init__.py`, which imports them when they
are used."""

from . import analysis, opensim, operators, plot, storage, studies, view
from .errors import (
    CriterionWarning,
    DisplayError,
    ExudynMusclesError,
    ExudynMusclesWarning,
    FrozenBodiesWarning,
    IncompleteRunWarning,
    ModelError,
    ModelFileError,
    ModelFileWarning,
    MotionError,
    MotionWarning,
    ParameterError,
    PassiveForceWarning,
    PathWarning,
    RecruitmentError,
    ResultFileError,
    SimulationError,
    SpanWarning,
    StabilityWarning,
    StartWarning,
    StorageError,
    StorageWarning,
    StudyError,
    TrackingWarning,
    UnknownForcesWarning,
    UnmetTorqueError,
    UnmetTorqueWarning,
    WindowError,
    WrappingError,
)
from .files.storage import Storage, read_storage
from .forces.actuators import PathActuator, PointActuator, Reserve, TorqueActuator
from .forces.external import ExternalForce
from .methods.cmc import CMCPlugin, CMCSettings, Prediction, computed_muscle_control
from .methods.cosimulation import CosimulationPlugin, cosimulate
from .methods.cosimulation_settings import CosimulationSettings, FirstIterate, Predictor, Scheme
from .methods.excitation_function import ExcitationFunction, SensedState
from .methods.forward import ForwardPlugin, ForwardSettings, forward_dynamics
from .methods.rest import muscles_at_rest
from .methods.static import StaticSettings, static_optimization
from .model import MusculoskeletalModel
from .motion import LowPass, Motion
from .muscle.activation import ActivationDynamics
from .muscle.dynamics import MuscleDynamics, muscle_dynamics, tendon_length
from .muscle.equilibrium import Equilibrium, equilibrium
from .muscle.laws.custom import CustomLaw
from .muscle.laws.de_groote_fregly_2016 import DeGrooteFregly2016, DeGrooteFregly2016Published
from .muscle.laws.law import HillCurves, MuscleLaw
from .muscle.laws.meyer_fregly_2016 import MeyerFregly2016
from .muscle.laws.millard_2012 import Millard2012
from .muscle.laws.schutte_1993 import Schutte1993
from .muscle.laws.spline_law import SplineLaw
from .muscle.laws.thelen_2003 import Thelen2003
from .muscle.laws.thelen_2003_deprecated import Thelen2003Deprecated
from .muscle.parameters import Muscle, MuscleSet
from .muscle.window import Integrator, WindowEnd, integrate_window
from .numerics.curves import Curve
from .numerics.products import SumOfProducts
from .numerics.splines import simm_spline
from .path.functions import FunctionPath
from .path.points import ConditionalPathPoint, MovingPathPoint, PathPoint
from .path.surfaces import PathWrap, WrapCylinder, WrapEllipsoid, WrapSphere, WrapTorus
from .recruitment.criteria.criterion import Criterion
from .recruitment.criteria.followed import Followed
from .recruitment.criteria.forces import SquaredForces
from .recruitment.criteria.joint_load import JointLoad
from .recruitment.criteria.minmax import MinMax
from .recruitment.criteria.powers import PoweredActivations, PoweredForces
from .recruitment.criteria.quantity import Quantity
from .recruitment.criteria.synergies import Synergies
from .recruitment.limits import ControlLimits
from .recruitment.normalizers import (
    MaximumIsometricForce,
    Normalizer,
    ReachableMaximum,
    RigidTendonForce,
    volume_weights,
)
from .recruitment.optimization import Solver
from .recruitment.settings import RecruitmentSettings
from .report import report
from .results.comparison import Difference
from .results.counts import Counts, Status
from .results.excitations import Excitations
from .results.trajectory import Trajectory
from .simulation.continuing import RunPoint
from .simulation.sensors import joint_load_sensor, muscle_sensor
from .skeleton.closures import Closure, ClosureKind, Loops
from .skeleton.coupling import DependentCoordinate, Follower, linear_function
from .skeleton.external_forces import add_external_force
from .skeleton.system.coordinates import (
    JointCoordinate,
    NodeCoordinate,
    RelativePosition,
    RelativeRotation,
    ScalarFunction,
)

__all__ = [
    "ActivationDynamics",
    "CMCPlugin",
    "CMCSettings",
    "Closure",
    "ClosureKind",
    "ConditionalPathPoint",
    "ControlLimits",
    "CosimulationPlugin",
    "CosimulationSettings",
    "Counts",
    "Criterion",
    "CriterionWarning",
    "Curve",
    "CustomLaw",
    "DeGrooteFregly2016",
    "DeGrooteFregly2016Published",
    "DependentCoordinate",
    "Difference",
    "DisplayError",
    "Equilibrium",
    "ExcitationFunction",
    "Excitations",
    "ExternalForce",
    "ExudynMusclesError",
    "ExudynMusclesWarning",
    "FirstIterate",
    "Followed",
    "Follower",
    "ForwardPlugin",
    "ForwardSettings",
    "FrozenBodiesWarning",
    "FunctionPath",
    "HillCurves",
    "IncompleteRunWarning",
    "Integrator",
    "JointCoordinate",
    "JointLoad",
    "Loops",
    "LowPass",
    "MaximumIsometricForce",
    "MeyerFregly2016",
    "Millard2012",
    "MinMax",
    "ModelError",
    "ModelFileError",
    "ModelFileWarning",
    "Motion",
    "MotionError",
    "MotionWarning",
    "MovingPathPoint",
    "Muscle",
    "MuscleDynamics",
    "MuscleLaw",
    "MuscleSet",
    "MusculoskeletalModel",
    "NodeCoordinate",
    "Normalizer",
    "ParameterError",
    "PassiveForceWarning",
    "PathActuator",
    "PathPoint",
    "PathWarning",
    "PathWrap",
    "PointActuator",
    "PoweredActivations",
    "PoweredForces",
    "Prediction",
    "Predictor",
    "Quantity",
    "ReachableMaximum",
    "RecruitmentError",
    "RecruitmentSettings",
    "RelativePosition",
    "RelativeRotation",
    "Reserve",
    "ResultFileError",
    "RigidTendonForce",
    "RunPoint",
    "ScalarFunction",
    "Scheme",
    "Schutte1993",
    "SensedState",
    "SimulationError",
    "Solver",
    "SpanWarning",
    "SplineLaw",
    "SquaredForces",
    "StabilityWarning",
    "StartWarning",
    "StaticSettings",
    "Status",
    "Storage",
    "StorageError",
    "StorageWarning",
    "StudyError",
    "SumOfProducts",
    "Synergies",
    "Thelen2003",
    "Thelen2003Deprecated",
    "TorqueActuator",
    "TrackingWarning",
    "Trajectory",
    "UnknownForcesWarning",
    "UnmetTorqueError",
    "UnmetTorqueWarning",
    "WindowEnd",
    "WindowError",
    "WrapCylinder",
    "WrapEllipsoid",
    "WrapSphere",
    "WrapTorus",
    "WrappingError",
    "add_external_force",
    "analysis",
    "computed_muscle_control",
    "cosimulate",
    "equilibrium",
    "forward_dynamics",
    "integrate_window",
    "joint_load_sensor",
    "linear_function",
    "muscle_dynamics",
    "muscle_sensor",
    "muscles_at_rest",
    "opensim",
    "operators",
    "plot",
    "read_storage",
    "report",
    "simm_spline",
    "static_optimization",
    "storage",
    "studies",
    "tendon_length",
    "view",
    "volume_weights",
]

__version__: str
