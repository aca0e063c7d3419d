"""Whole runs."""

from tests.benchmarks import timed

from .cases import LONGEST, ROOT, least, needs


class Runs:
    """Of every method, with each of these models."""

    params = (
        [timed.PENDULUM, "arm26", "gait2354"],
        ["the paper's four", "CSF", "consistent", "CMC"],
    )
    param_names = ("model", "method")
    unit = "CPU s per simulated s"
    timeout = LONGEST

    def setup(self, model, method):
        needs(model)
        case = timed.timed(model, ROOT)
        if method not in case.runs:
            raise NotImplementedError(f"{model} has no run by {method}")
        self.run, self.simulated = case.runs[method], case.simulated

    def track_cpu(self, model, method):
        return least(self.run) / self.simulated
