"""Sources and outcomes that processes of a study import."""

import os
import time
from pathlib import Path

import numpy as np

from exudyn_muscles import studies
from models import leg, pendulum

PENDULUM = "models.pendulum:build"
RANGES = {
    "*.max_isometric_force.factor": (0.9, 1.1),
    "settings.kp": (300.0, 600.0),
    "motion.noise": (1e-4, 1e-3),
}
OUTCOMES = {
    "peak": "max(tendon_forces)",
    "error": "rms(tracking_errors/theta)",
    "share": "max(muscle_analysis:passive_share)",
}


def short_motion():
    """The first tenth of a second."""
    return pendulum.motion().between(0.0, 0.1)


def study(count=6, **changes):
    """The pendulum's first tenth of a second by CSF."""
    source = studies.Builder(PENDULUM, "tests.studies.subjects:short_motion")
    given = {"samples": studies.latin_hypercube(RANGES, count), "method": "csf", "seed": 3}
    return studies.Study(source, **{**given, "outcomes": OUTCOMES, **changes})


def build_unless(weak=0.0, gone=0.0, marks=""):
    """The pendulum; raises if `weak`, ends the process if `gone`, and says that it was there."""
    if marks:
        Path(marks, f"{os.getpid()}_{time.monotonic_ns()}").touch()
    if weak:
        raise ValueError(f"too weak: {weak:g}")
    if gone:
        os._exit(3)
    return pendulum.build()


def faulty(weak=(), gone=(), count=6, marks=""):
    """A study in which some samples raise and some end their process."""
    values = np.zeros((count, 2))
    values[list(weak), 0] = values[list(gone), 1] = 1.0
    samples = studies.Samples(("source.weak", "source.gone"), values)
    source = studies.Builder(
        "tests.studies.subjects:build_unless", short_motion, {"marks": str(marks)}
    )
    return studies.Study(source, samples, "csf", {"peak": "max(tendon_forces)"})


def slowest_force(model, result):
    """An outcome of a user's own."""
    return result.tendon_forces[-1].min() / model.muscles.max_isometric_force.max()


def no_number(model, result):
    return "much"


def first_steps():
    """The leg's motion from 0.3 to 0.35 s."""
    return leg.motion().between(0.3, 0.35)
