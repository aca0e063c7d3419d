"""CPU seconds per simulated second of the methods, beside another version of this package:

    python -m tests.benchmarks.speed [--beside FOLDER] [--core FOLDER] [--rounds N]

from the repository's root, with OpenSim's CMC cases in `../shared/opensim/cmc`; that of
gait10dof18musc in a clone of opensim-core, which `--core` names. `--beside` names a checkout of the
other version. Each version lives in one process, and every run is timed in both by turns. Prints
the least of all rounds and asserts nothing.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

from . import timed

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


def rows(folders, core, rounds):
    """Case, method and the least CPU seconds per simulated second of each version."""
    versions = [Version(folder) for folder in folders]
    cases = {timed.PENDULUM: (".", ["the paper's four"])}
    for name, case in timed.SETUPS.items():
        folder = core if case.folder == timed.CORE else ROOT
        if folder is not None and (folder / case.folder).is_dir():
            cases[name] = str(folder), ["CSF", "consistent", "CMC"]
        else:
            print(f"{name}: no {case.folder}")
    for name, (folder, methods) in cases.items():
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
    parser.add_argument("--rounds", type=int, default=7, metavar="N", help="default 7")
    arguments = parser.parse_args()
    folders = [ROOT] if arguments.beside is None else [arguments.beside.resolve(), ROOT]
    print("| CPU s per simulated s |" + (" before | now | ratio |" if len(folders) > 1 else " |"))
    print("|---|" + "---|" * (3 if len(folders) > 1 else 1))
    for name, method, times in rows(folders, arguments.core, arguments.rounds):
        figures = [f"{seconds:.3g}" for seconds in times]
        if len(times) > 1:
            figures.append(f"{times[1] / times[0]:.2f}")
        print(f"| {name}, {method} | {' | '.join(figures)} |", flush=True)


if __name__ == "__main__":
    main()
