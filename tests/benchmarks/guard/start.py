"""What a new process needs, user and system time together."""

import tempfile
from pathlib import Path

import exudyn_muscles as em
from tests.benchmarks import startup

from .cases import LONGEST, ROOT, ROUNDS, needs

PACKAGE = Path(em.__file__).parents[1]
PENDULUM = f"""import sys
sys.path.append({str(ROOT)!r})
from models import pendulum
pendulum.build(), pendulum.motion()"""
CODE = {
    "import exudyn": "import exudyn",
    "import, and the pendulum's model and motion": PENDULUM,
    "import, and gait2354 with its set-up": startup.LOADED,
}


class Start:
    params = [*CODE]  # noqa: RUF012
    param_names = ("process",)
    unit = "CPU s"
    timeout = LONGEST

    def setup(self, process):
        if "gait2354" in process:
            needs("gait2354")

    def track_cpu(self, process):
        with tempfile.TemporaryDirectory() as kernels:
            times = [startup.cpu_time(PACKAGE, CODE[process], kernels) for _ in range(1 + ROUNDS)]
        return min(times[1:])
