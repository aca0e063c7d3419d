"""A study of the leg on engines, and killed in its middle: the same table, and what it costs.

    python -m tests.benchmarks.studies --samples 1000

prints wall times beside the ideal split: the time that one process takes for each run, over the
number of processes.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from distributed import Client, LocalCluster

from exudyn_muscles import studies
from exudyn_muscles.studies.journal import NAME
from exudyn_muscles.studies.running import TABLE

LEG = Path(__file__).parents[2] / "models" / "leg.py"
RANGES = {
    "soleus.tendon_slack_length.factor": (0.97, 1.03),
    "*.max_isometric_force.factor": (0.8, 1.2),
    "mass.*.factor": (0.9, 1.1),
    "settings.kp": (300.0, 600.0),
    "motion.noise": (1e-4, 1e-3),
}
OUTCOMES = {
    "soleus": "max(tendon_forces/soleus)",
    "knee_error": "rms(tracking_errors/knee)",
    "knee_load": "max(joint_forces:size/knee)",
    "unmet": "max_unmet_torque",
}
PROCESSES = 2
SERIAL = 100  # runs that one process makes for the ideal split


def leg_study(count: int) -> studies.Study:
    samples = studies.latin_hypercube(RANGES, count, seed=1)
    return studies.Study(studies.PythonFile(LEG), samples, "csf", OUTCOMES, seed=2)


def timed(study, folder, engine):
    begun = time.perf_counter()
    studies.run(study, folder, engine, quiet=True)
    return time.perf_counter() - begun


def killed(count: int, folder: Path) -> int:
    """Kill the study when half of it is done; how many runs it had then."""
    command = [sys.executable, "-m", __spec__.name, "--only", str(folder), "--samples", str(count)]
    process = subprocess.Popen(command, start_new_session=True)
    journal = folder / NAME
    while process.poll() is None:
        time.sleep(0.05)
        if journal.exists() and journal.read_bytes().count(b"\n") > count // 2:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    return journal.read_bytes().count(b"\n") - 1


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--only", type=Path)
    arguments = parser.parse_args()
    count = arguments.samples
    study = leg_study(count)
    if arguments.only:
        studies.run(study, arguments.only, PROCESSES, quiet=True)
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        timed(leg_study(1), folder / "warm", 1)
        alone = timed(leg_study(SERIAL), folder / "serial", 1) / SERIAL
        ideal = alone * count / PROCESSES
        print(f"one process: {alone:.3f} s a run; ideal for {count} on two: {ideal:.1f} s")
        wall = timed(study, folder / "processes", PROCESSES)
        print(f"2 processes: {wall:.1f} s, {wall / ideal - 1:+.1%}")
        cluster = LocalCluster(n_workers=PROCESSES, threads_per_worker=1, dashboard_address=None)
        with cluster, Client(cluster) as client:
            wall = timed(study, folder / "dask", client)
            print(f"dask, 2 workers: {wall:.1f} s, {wall / ideal - 1:+.1%}")
        done = killed(count, folder / "killed")
        wall = timed(study, folder / "killed", PROCESSES)
        print(f"killed after {done} runs, continued in {wall:.1f} s")
        names = ("processes", "dask", "killed")
        contents = {(folder / name / TABLE).read_bytes() for name in names}
        print(f"the same table to the bit: {len(contents) == 1}")


if __name__ == "__main__":
    main()
