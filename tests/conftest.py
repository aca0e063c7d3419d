"""Settings for all tests, and a line about those that were left out.

Hypothesis draws the same examples in every run, so that a failure can be repeated. A longer, random
search: `pytest --hypothesis-profile=search`.
"""

import os

# Before NumPy: two threads for the matrices of this size, in each of the processes that run tests
# side by side, take several times as long as one.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from hypothesis import HealthCheck, settings

from .opensim import ABSENT, REFERENCE

settings.register_profile(
    "default", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.filter_too_much]
)
settings.register_profile(
    "search", settings.get_profile("default"), derandomize=False, max_examples=3000
)
settings.load_profile("default")


def pytest_terminal_summary(terminalreporter):
    skipped = terminalreporter.stats.get("skipped", [])
    absent = sum(ABSENT in str(report.longrepr) for report in skipped)
    if absent:
        terminalreporter.write_line(
            f"{absent} tests were skipped because {REFERENCE} is absent: they read OpenSim's files"
        )
