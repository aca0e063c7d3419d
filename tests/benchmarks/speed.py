"""CPU seconds per simulated second of the methods, beside another version of this package:

    python -m tests.benchmarks.speed [--beside FOLDER] [--core FOLDER] [--models FOLDER]
                                     [--rounds N] [--only NAME ...]

from the repository's root, with OpenSim's CMC cases in `../shared/opensim/cmc`; that of
gait10dof18musc in a clone of opensim-core, which `--core` names, and Hamner's running body in one
of opensim-models, which `--models` names. `--beside` names a checkout of the other version. Each
version lives in one process, and every run is timed in both by turns. Prints the least of all
rounds and asserts nothing.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from . import timed
from .published_cmc import CASES, lay_out

ROOT = Path(__file__).parents[2]


class Version:
    """A process in which one version's runs are timed."""

    def __init__(self, folder):
        environment = os.environ | {"PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1"}
        self._process = subprocess.Popen(
            [sys.executable, timed.__file__], env=environment, cwd=ROOT, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def time(self, *names):
        """CPU seconds per simulated second of one run."""
        print(json.dumps(names), file=self._process.stdin, flush=True)
        for line in self._process.stdout:
            if line.startswith(timed.ANSWER):
                return json.loads(line.removeprefix(timed.ANSWER))
        raise SystemExit(f"{' '.join(names)}: the process that times ended")

    def end(self):
        self._process.stdin.close()
        self._process.wait()


def rows(folders, places, rounds, only):
    """Case, method and the least CPU seconds per simulated second of each version; `places` are the
    folders that have the set-ups, of those that are not beside the repository, `only` the names of
    some cases."""
    versions = [Version(folder) for folder in folders]
    cases = {timed.PENDULUM: (".", ["the paper's four"])}
    for name, case in timed.SETUPS.items():
        folder = places.get(name, ROOT)
        if folder is not None and (folder / case.folder / case.setup).is_file():
            cases[name] = str(folder), ["CSF", "consistent", "CMC"]
        else:
            print(f"{name}: its files are not there", file=sys.stderr)
    for name, (folder, methods) in cases.items():
        if only and name not in only:
            continue
        for method in methods:
            each = [
                [version.time(name, folder, method) for version in versions]
                for _ in range(rounds + 1)  # the first one compiles
            ]
            yield name, method, [min(times) for times in zip(*each[1:], strict=True)]
    for version in versions:
        version.end()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--beside", type=Path, metavar="FOLDER", help="checkout of another version")
    parser.add_argument("--core", type=Path, metavar="FOLDER", help="clone of opensim-core")
    parser.add_argument("--models", type=Path, metavar="FOLDER", help="clone of opensim-models")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="of these cases")
    parser.add_argument("--rounds", type=int, default=7, metavar="N", help="default 7")
    arguments = parser.parse_args()
    folders = [ROOT] if arguments.beside is None else [arguments.beside.resolve(), ROOT]
    print("| CPU s per simulated s |" + (" before | now | ratio |" if len(folders) > 1 else " |"))
    print("|---|" + "---|" * (3 if len(folders) > 1 else 1))
    with tempfile.TemporaryDirectory() as running:
        if arguments.models is not None:
            lay_out(CASES["Hamner"], [arguments.models], Path(running))
        places = {"gait10dof18musc": arguments.core, "Hamner": Path(running)}
        for name, method, times in rows(folders, places, arguments.rounds, arguments.only):
            figures = [f"{seconds:.3g}" for seconds in times]
            if len(times) > 1:
                figures.append(f"{times[1] / times[0]:.2f}")
            print(f"| {name}, {method} | {' | '.join(figures)} |", flush=True)


if __name__ == "__main__":
    main()
