"""What a new process needs, user and system time together."""

import tempfile
from pathlib import Path

import exudyn_muscles as em
from tests.benchmarks import startup

from .cases import LONGEST, ROUNDS, needs

PACKAGE = Path(em.__file__).parents[1]
CODE = {
    "import exudyn": "import exudyn",
    "import exudyn_muscles": "import exudyn_muscles",
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
