from .compute import evaluate
from .description import SystemDescription
from .identification import Identified, TorqueRecord, identify
from .indices import indices
from .method import Method
from .running import run
from .samples import Samples, latin_hypercube, morris_design, sobol_design, sobol_sequence
from .slack_lengths import choose_tendon_slack_lengths
from .source import Builder, OsimFile, PythonFile, SetupFile, Source, Subject
from .study import Study

__all__ = [
    "Builder",
    "Identified",
    "Method",
    "OsimFile",
    "PythonFile",
    "Samples",
    "SetupFile",
    "Source",
    "Study",
    "Subject",
    "SystemDescription",
    "TorqueRecord",
    "choose_tendon_slack_lengths",
    "evaluate",
    "identify",
    "indices",
    "latin_hypercube",
    "morris_design",
    "run",
    "sobol_design",
    "sobol_sequence",
]
