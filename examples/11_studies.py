"""The same model many times: one source for a study on all cores, for Exudyn's own variation of
parameters, and for its genetic optimization.

Whatever makes runs in other processes needs a source: a small value that builds the model there.
"""

import sys
from functools import partial
from pathlib import Path

from exudyn.processing import GeneticOptimization, ParameterVariation

from exudyn_muscles import studies

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT))

STRENGTH, SLACK = "*.max_isometric_force.factor", "left.tendon_slack_length.factor"
OUTCOMES = {"peak": "max(activations/left)", "mean": "mean(activations/left)"}
MEASURED = 0.55  # largest activation of the left muscle, as by EMG

source = studies.PythonFile(ROOT / "models" / "pendulum.py")
samples = studies.latin_hypercube({STRENGTH: (0.8, 1.2), SLACK: (0.96, 1.04)}, 8, seed=1)
study = studies.Study(source, samples, "static", OUTCOMES)


def outcome(study, name, parameters):
    """A number of one run, as Exudyn's functions want it."""
    return studies.evaluate(study, parameters)[name]


def distance(study, parameters):
    """By how much a run's largest activation is off the measured one."""
    return abs(outcome(study, "peak", parameters) - MEASURED)


if __name__ == "__main__":  # processes import this file
    table = studies.run(study, "out/study", engine=2)
    print(table[[STRENGTH, SLACK, "status", *OUTCOMES]].round(4).to_string())

    # Exudyn's own: functions of a dictionary of parameters; useMultiProcessing=True on all cores.
    quiet = {"showProgress": False}
    peak = partial(outcome, study, "peak")
    varied, peaks = ParameterVariation(peak, {STRENGTH: (0.8, 1.2, 3)}, **quiet)
    print("peak activations over strength:", dict(zip(varied[STRENGTH], peaks, strict=True)))

    best, error, *_ = GeneticOptimization(
        partial(distance, study), {STRENGTH: (0.7, 1.3)}, populationSize=6, numberOfGenerations=4,
        elitistRatio=0.4, distanceFactor=0.0, randomizerInitialization=1, **quiet,
    )  # fmt: skip
    print(f"the measured peak is met with {best[STRENGTH]:.3f} times the strength, to {error:.1e}")
