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
from .names import FAILED, PROGRAM

if TYPE_CHECKING:
    import pandas

EPILOG = f"""example: {PROGRAM} study STUDY.toml --out out --engine 4
         {PROGRAM} study FOLDER --out out
writes out/table.parquet, a row for each run, with indices and their figures where the samples are
Morris' or Sobol's; the same line goes on where it was stopped. A STUDY.toml has

[source]
model = "leg.py"                          # or .osim with motion = FILE, or a set-up (.xml)
# folder = "setups"                       # or all set-ups there, with pattern = "**/*CMC*.xml"
# angles = "degrees"                      # of motions whose files do not say so
[method]
name = "csf"
settings = {{step = 0.01}}
[samples]
design = "sobol"                          # latin_hypercube, sobol_sequence, morris; or file = TABLE
count = 64
[samples.parameters]
"soleus.tendon_slack_length.factor" = [0.95, 1.05]
"*.max_isometric_force.factor" = [0.8, 1.2]
[outcomes]
peak = "max(tendon_forces/soleus)"

needs joblib, dask and others: pip install 'exudyn_muscles[study]'"""
SHOWN = 5  # runs of which is told why they failed


def add_options(parser: argparse.ArgumentParser) -> None:
    """What `study` takes."""
    parser.add_argument(
        "model",
        metavar="STUDY",
        type=Path,
        help="study file (.toml), or a folder: all set-ups of CMC and static optimization below it",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        required=True,
        help="folder for the table, made if needed; a study that is there already goes on",
    )
    parser.add_argument(
        "--engine",
        metavar="N",
        type=_engine,
        default=1,
        help="number of processes, or the address of a dask scheduler such as tcp://10.0.0.1:8786; "
        "default 1",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.add_argument(
        "--no-figures", dest="figures", action="store_false", help="tables alone, no figures"
    )


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


def _engine(text: str) -> int | str:
    return int(text) if text.isdecimal() else text
