"""What a person waits for: import, the command line, the first use on a machine, loading.

`python -m tests.benchmarks.startup` prints the CPU time of processes of their own, user and system
together, the least of seven (of two, where kernels are compiled). `--beside FOLDER` does the same
with another checkout, in turns with this one.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from .timed import SETUPS

HERE = Path(__file__).parents[2]
SETUP = HERE / SETUPS["gait2354"].folder / SETUPS["gait2354"].setup
MODEL = "import sys; sys.path.insert(0, 'models'); import pendulum, exudyn_muscles as em\n"
COMMAND = "from exudyn_muscles.cli import main\ntry: main({})\nexcept SystemExit: pass"
FIRST_STEP = """
import os, time
def stop(t):
    print(time.process_time(), flush=True)
    os._exit(0)
em.cosimulate(pendulum.build(), pendulum.motion(), progress=stop)"""
LOADED = f"import exudyn_muscles as em; em.opensim.load_setup({str(SETUP)!r})"
LOADED_AGAIN = f"""{LOADED}
import time
begun = time.process_time()
em.opensim.load_setup({str(SETUP)!r})
print(time.process_time() - begun)"""
EXAMPLE = "import runpy; runpy.run_path('examples/01_shortest_program.py')"
STORED = ["check", *2 * ["tests/reference/pendulum_csf.npz"]]

# What a process does. Its last line is a CPU time [s], or else its own counts, from its beginning.
ROWS = {
    "`import exudyn`": "import exudyn",
    "`import exudyn_muscles`": "import exudyn_muscles",
    "import, and the pendulum's model and motion": f"{MODEL}pendulum.build(), pendulum.motion()",
    "until the pendulum's first step": MODEL + FIRST_STEP,
    "`exudyn-muscles --help`": COMMAND.format(["--help"]),
    "`exudyn-muscles check` of two results": COMMAND.format(STORED),
    "`examples/01`, kernels stored": EXAMPLE,
    "`examples/01`, first use": EXAMPLE,
}
LOADING = {
    "import, and gait2354 with its set-up": LOADED,
    "loading it again": LOADED_AGAIN,
}


def cpu_time(folder: Path, code: str, cache: str) -> float:
    """CPU time [s] of what a new process does with a checkout, whose kernels are in `cache`."""
    own = "\nimport time; print(time.process_time())" if "process_time" not in code else ""
    usual = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    printed = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code + own],
        env={**usual, "PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": cache},
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=True,
    ).stdout  # fmt: skip
    return float(printed.split()[-1])


def rows(folders: list[Path]) -> Iterator[tuple[str, list[float]]]:
    """Every row, and its least CPU times [s] with each of these checkouts."""
    with tempfile.TemporaryDirectory() as cache:
        stored = [str(Path(cache) / str(k)) for k in range(len(folders))]
        for name, code in (ROWS | (LOADING if SETUP.exists() else {})).items():
            first = "first use" in name
            if not first:  # stores kernels and bytecode
                for folder, place in zip(folders, stored, strict=True):
                    cpu_time(folder, code, place)
            times = []
            for _ in range(2 if first else 7):
                with tempfile.TemporaryDirectory() as empty:
                    new = [str(Path(empty) / str(k)) for k in range(len(folders))]
                    pairs = zip(folders, new if first else stored, strict=True)
                    times.append([cpu_time(folder, code, place) for folder, place in pairs])
            yield name, [min(each) for each in zip(*times, strict=True)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--beside", metavar="FOLDER", type=Path, help="another checkout")
    beside = parser.parse_args().beside
    folders = [HERE] if beside is None else [beside.resolve(), HERE]
    print(f"| CPU s | {'this version' if beside is None else f'{beside} | this version'} |")
    print("|---" * (1 + len(folders)) + "|")
    for name, times in rows(folders):
        print(f"| {name} | {' | '.join(f'{each:.2f}' for each in times)} |", flush=True)


if __name__ == "__main__":
    main()
