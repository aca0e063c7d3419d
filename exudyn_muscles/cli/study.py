"""`exudyn-muscles study`: many runs from one line."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from .. import plot
from ..errors import StudyError
from ..files.disk import write_figure, write_file
from ..studies.indices import indices
from ..studies.running import TABLE
from ..studies.running import run as run_study
from ..studies.study import Study
from ..studies.study_file import load_study
from .files import made_folder
from .names import FAILED

if TYPE_CHECKING:
    import pandas

SHOWN = 5  # runs of which is told why they failed


def study(arguments: argparse.Namespace) -> int:
    """All runs of a study."""
    given = load_study(arguments.model)
    out = made_folder(arguments.out)
    table = run_study(given, out, arguments.engine, quiet=arguments.quiet)
    print(summary(table))
    print(f"wrote {out / TABLE}")
    if given.samples.design and len(given.sources) == 1:
        for outcome in given.columns:
            _write_indices(given, table, outcome.name, out, arguments.figures)
    nothing = table["status"].isin(["failed", "died"]).all()
    return FAILED if nothing or (table["status"] == "died").any() else 0


def summary(table: pandas.DataFrame) -> str:
    """How the runs ended, what failed in the first of them, and the outcomes' ranges."""
    counts = table["status"].value_counts()
    lines = [f"{len(table)} runs: " + ", ".join(f"{n} {status}" for status, n in counts.items())]
    failed = table[table["status"].isin(["failed", "died"])]
    several = table["source"].nunique() > 1
    for _, row in failed.head(SHOWN).iterrows():
        whose = f" ({row['source']})" if several else ""
        lines.append(f"  run {row['run']}{whose} {row['status']}: {row['message']}")
    if len(failed) > SHOWN:
        lines.append(f"  and {len(failed) - SHOWN} more")
    after = list(table.columns)
    for name in after[after.index("status") + 1 : after.index("message")]:
        found = table[name].dropna()
        if len(found):
            middle, low, high = found.median(), found.min(), found.max()
            lines.append(f"{name}: {low:.4g} to {high:.4g}, median {middle:.4g}")
    return "\n".join(lines)


def _write_indices(
    given: Study, table: pandas.DataFrame, outcome: str, out: Path, figures: bool
) -> None:
    stem = "indices_" + re.sub(r"\W+", "_", outcome).strip("_")
    try:
        found = indices(given.samples, table, outcome)
    except StudyError as error:
        print(error)
        return
    write_file(out / f"{stem}.csv", found.to_csv().encode())
    print(f"wrote {out / stem}.csv")
    if figures:
        import matplotlib.pyplot as plt

        figure = plot.indices(found).get_figure(root=True)
        assert figure is not None
        write_figure(figure, out / f"{stem}.png", 150)
        plt.close(figure)
        print(f"wrote {out / stem}.png")
