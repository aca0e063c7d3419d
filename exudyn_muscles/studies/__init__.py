"""Many runs: samples in, one table out, on an engine that exists.

source = studies.PythonFile(Path("models/leg.py"))
samples = studies.latin_hypercube({"soleus.tendon_slack_length.factor": (0.95, 1.05)}, 100)
study = studies.Study(source, samples, "csf", {"peak": "max(tendon_forces/soleus)"})
table = studies.run(study, "out", engine=2)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
