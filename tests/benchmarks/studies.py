"""A study of the leg on engines, and killed in its middle: the same table, and what it costs.

    python -m tests.benchmarks.studies --samples 1000

prints wall times beside the ideal split: the time that workers spend within runs, from building the
model to the last outcome, over their number. Wall time that others take from this machine is in
both.
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
from models import leg

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
    "spent": "tests.benchmarks.studies:spent",
}
PROCESSES = 2
TIMES = "STUDY_TIMES"  # variable that names the file to which workers write what they spend
begun: list[float] = []  # of the run that this process is at


def build():
    """The leg, and when it was begun."""
    begun[:] = [time.perf_counter()]
    return leg.build()


def spent(model, result) -> float:
    """The last outcome: nothing, but writes how long the run has taken."""
    with open(os.environ[TIMES], "a") as stream:
        stream.write(f"{time.perf_counter() - begun[0]}\n")
    return 0.0


def leg_study(count: int) -> studies.Study:
    samples = studies.latin_hypercube(RANGES, count, seed=1)
    source = studies.Builder("tests.benchmarks.studies:build", "models.leg:motion")
    return studies.Study(source, samples, "csf", OUTCOMES, seed=2)


def timed(name: str, study: studies.Study, folder: Path, engine) -> None:
    """Run, and print how long it takes."""
    times = Path(os.environ[TIMES])
    times.write_text("")
    at = time.perf_counter()
    studies.run(study, folder, engine, quiet=True)
    wall = time.perf_counter() - at
    each = [float(line) for line in times.read_text().splitlines()]
    ideal = sum(each) / PROCESSES
    print(
        f"{name}: {len(each)} runs of {sum(each) / len(each):.3f} s in {wall:.1f} s, ideal split "
        f"{ideal:.1f} s, {wall / ideal - 1.0:+.1%}",
        flush=True,
    )


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
        os.environ[TIMES] = str(folder / "times")
        studies.run(leg_study(100), folder / "warm", quiet=True)  # kernels are there
        timed("2 processes", study, folder / "processes", PROCESSES)
        cluster = LocalCluster(n_workers=PROCESSES, threads_per_worker=1, dashboard_address=None)
        with cluster, Client(cluster) as client:
            timed("dask, 2 workers", study, folder / "dask", client)
        done = killed(count, folder / "killed")
        timed(f"killed after {done}", study, folder / "killed", PROCESSES)
        names = ("processes", "dask", "killed")
        contents = {(folder / name / TABLE).read_bytes() for name in names}
        print(f"the same table to the bit: {len(contents) == 1}")


if __name__ == "__main__":
    main()
