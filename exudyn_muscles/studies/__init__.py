"""Many runs: samples in, one table out, on an engine that exists.

source = studies.PythonFile(Path("models/leg.py"))
samples = studies.latin_hypercube({"soleus.tendon_slack_length.factor": (0.95, 1.05)}, 100)
study = studies.Study(source, samples, "csf", {"peak": "max(tendon_forces/soleus)"})
table = studies.run(study, "out", engine=2)
"""

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
