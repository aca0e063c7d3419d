r"""Draws how CPU times went from version to version:

    python -m tests.benchmarks.trend

from what `asv` has stored in `tests/benchmarks/results/reference` into `docs/speed_trend.png`. That
folder has the results of a machine that is called so, and nothing else is said of it. Once:

    asv machine --config tests/benchmarks/asv.conf.json --machine reference --os Linux --cpu "" \
        --num_cpu "" --ram "" --yes

and then for a version:

    asv run --config tests/benchmarks/asv.conf.json --machine reference "main^!"
"""

import ast
import itertools
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from exudyn_muscles.plot.styles import COLORS

HERE = Path(__file__).parent
RESULTS = HERE / "results" / "reference"
PICTURE = HERE.parents[1] / "docs" / "speed_trend.png"

WHOLE, RUNS, PARTS = "parts.Step.track_step", "runs.Runs.track_cpu", "parts.Step.track_"
MODEL = "gait2354"
STACK = {  # from below
    "exudyn": "Exudyn alone",
    "dynamics": "dynamics",
    "path": "paths",
    "recruitment": "recruitment",
    "window": "windows",
}
MODELS = ["pendulum", "arm26", MODEL]  # each has a color, and every method a line
SHADES = [COLORS[k] for k in (6, 2, 4, 5, 1)]
LINES = {"the paper's four": "-", "CSF": "-", "consistent": "--", "CMC": ":"}


class Version(NamedTuple):
    """A commit, its time, and what was measured: benchmark and parameters -> number."""

    commit: str
    date: datetime
    measured: dict[tuple[str, ...], float]


def read(folder=RESULTS):
    """The versions from old to new."""
    versions = []
    for file in folder.glob("*-*.json"):
        stored = json.loads(file.read_text())
        measured = {}
        for benchmark, (values, parameters, *_) in stored["results"].items():
            names = itertools.product(*(map(ast.literal_eval, each) for each in parameters))
            for value, key in zip(values or [], names, strict=False):
                if value is not None and np.isfinite(value):
                    measured[benchmark, *key] = value
        date = datetime.fromtimestamp(stored["date"] / 1e3, UTC)
        versions.append(Version(stored["commit_hash"][:7], date, measured))
    return sorted(versions, key=lambda version: version.date)


def draw(versions):
    """The picture: whole runs at the left, a step and its parts at the right."""
    figure = Figure(figsize=(11.0, 5.2), layout="constrained")
    runs, parts = figure.subplots(1, 2)
    places = np.arange(len(versions))

    def along(*key):
        return np.array([version.measured.get(key, np.nan) for version in versions])

    keys = {key for version in versions for key in version.measured if key[0] == RUNS}
    for model, method in itertools.product(MODELS, LINES):
        if (RUNS, model, method) in keys:
            runs.plot(
                places, along(RUNS, model, method), f"o{LINES[method]}", markersize=4,
                color=COLORS[MODELS.index(model)], label=f"{model}, {method}",
            )  # fmt: skip
    runs.set(yscale="log", title="Whole runs", ylabel="CPU s per simulated s")
    runs.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    runs.yaxis.set_major_formatter("{x:g}")
    runs.yaxis.set_minor_formatter(NullFormatter())

    below = np.zeros(len(versions))
    for (part, name), color in zip(STACK.items(), SHADES, strict=True):
        height = np.nan_to_num(along(PARTS + part, MODEL))
        parts.bar(places, height, 0.6, below, label=name, color=color)
        below += height
    parts.plot(places, along(WHOLE, MODEL), "ko-", markersize=4, label="the whole step")
    parts.set(title=f"A step of 10 ms of CSF, {MODEL}", ylabel="CPU ms", ylim=(0.0, None))

    labels = [f"{version.commit}\n{version.date:%d %b\n%H:%M}" for version in versions]
    for panel in (runs, parts):
        panel.set_xticks(places, labels, fontsize=8)
        panel.grid(axis="y", which="both", alpha=0.25)
        panel.set_axisbelow(True)
    beneath = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16), "fontsize": 8}
    runs.legend(ncols=3, **beneath)
    parts.legend(ncols=3, **beneath)
    return figure


def main():
    draw(read()).savefig(PICTURE, dpi=130)


if __name__ == "__main__":
    main()
