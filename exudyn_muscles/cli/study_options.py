"""What `exudyn-muscles study` takes."""

from __future__ import annotations

import argparse
from pathlib import Path

from .names import PROGRAM

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


def _engine(text: str) -> int | str:
    return int(text) if text.isdecimal() else text
