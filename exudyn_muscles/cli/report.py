"""What is printed about results."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..model import MusculoskeletalModel
from ..motion import Motion
from ..results.counts import Status
from ..results.trajectory import Trajectory
from .names import CMC_STEPS, FAILED, METHODS, PAPER, PROGRAM
from .settings import velocity_gain


def summary(name: str, trajectory: Trajectory) -> str:
    """What `run` and `cmc` print about a result."""
    counts = trajectory.counts
    span = f"t = {trajectory.time[0]:g} to {trajectory.time[-1]:g} s"
    status = trajectory.status.name.lower()
    lines = [
        f"{name}, {METHODS[trajectory.method]}: {status}, {span}, {counts.steps} steps",
        f"CPU time: {trajectory.cpu_time:.3f} s",
    ]
    if trajectory.method != "static":
        lines.append(f"RMS tracking error: {', '.join(_errors(trajectory))}")
    lines.append(
        f"{counts.recruitments} recruitments, {counts.window_integrations} window integrations, "
        f"{counts.newton_iterations} Newton iterations, {counts.rejected_steps} rejected steps"
    )
    lines.append(f"unmet torque [N m, or N]: {trajectory.unmet_torque_report() or 'none'}")
    if trajectory.reserve_names:
        lines.append(f"reserves and residuals: {trajectory.reserve_report() or 'none needed'}")
    if off := trajectory.tracking_report():
        lines.append(f"tracking: {off}")
    if drift := trajectory.max_constraint_drift:
        lines.append(f"largest violation of constraints [m, rad, or 1]: {drift:.2g}")
    return "\n".join(lines)


def _errors(trajectory: Trajectory) -> Iterator[str]:
    """RMS tracking errors with their units: degrees, or millimetres of a prismatic joint."""
    rms = trajectory.tracking_error_rms()
    for name, error, rotates in zip(
        trajectory.coordinate_names, rms, _rotates(trajectory), strict=True
    ):
        if rotates:
            yield f"{name} {math.degrees(error):.4g} deg"
        else:
            yield f"{name} {1e3 * error:.4g} mm"


def comparison_text(
    arguments: argparse.Namespace,
    results: Mapping[str, Trajectory],
    model: MusculoskeletalModel,
    motion: Motion,
    rows: Mapping[str, Mapping[str, Any]],
    differences: Mapping[str, float],
) -> str:
    """What `compare` prints."""
    head = [
        ("", "CPU", "RMS error", "recruitments", "window integr.", "Newton iter.", "max unmet"),
        ("method", "s", "deg", "per step", "per step", "per step", "torque N m"),
    ]
    body = []
    for method, row in rows.items():
        cpu, error = f"{row['cpu_s']:.3f}", row["rms_error_deg"]
        work = ("recruitments", "window_integrations", "newton_iterations")
        counts = [f"{row[f'{count}_per_step']:.2f}" for count in work]
        unmet = f"{row['max_unmet_torque']:.3g}"
        body.append(
            (METHODS[method], cpu, "-" if error is None else f"{error:.4f}", *counts, unmet)
        )
    table = [*head, *body]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = []
    for method, *cells in table:
        right = [cell.rjust(width) for cell, width in zip(cells, widths[1:], strict=True)]
        lines.append("  ".join([method.ljust(widths[0]), *right]))
    lines.insert(len(head), "-" * len(lines[0]))

    step = 1e3 * arguments.step
    title = (
        f"{arguments.model.stem}: {_number(len(model.coordinates), 'coordinate')}, "
        f"{_number(len(model.muscles), 'muscle')}, {motion.end - motion.start:g} s of motion; "
        f"kp = {arguments.kp:g} 1/s^2, kv = {velocity_gain(arguments):.4g} 1/s, step {step:g} ms"
    )
    static, cmc = differences["static_csf"], differences["cmc_csf"]
    inner = f"{step / CMC_STEPS:g} ms"
    notes = [
        f"A step of CMC is its window of {step:g} ms; its Newton iterations are per {inner} step.",
        "Window integrations are those of all muscles together.",
        f"CPU time: the best of {_number(arguments.repeat, 'run')} in a warm process.",
        f"Largest difference of excitations: Static - CSF {static:.4f}, CMC - CSF {cmc:.4f}.",
    ]
    drifts = {METHODS[name]: result.max_constraint_drift for name, result in results.items()}
    if any(drifts.values()):
        each = ", ".join(f"{label} {drift:.2g}" for label, drift in drifts.items())
        notes.append(f"Largest violation of constraints [m, rad, or 1]: {each}.")
    if len(model.coordinates) > 1:
        for method, label in PAPER.items():
            if method != "static":
                errors = ", ".join(_errors(results[method]))
                notes.append(f"RMS tracking error of {label}: {errors}")
    return "\n".join([title, "", *lines, "", *notes])


def figures_of_merit(trajectory: Trajectory, cpu_time: float) -> dict[str, Any]:
    """One method's row of the comparison; the start's recruitment does not count."""
    counts, windows = trajectory.counts, max(len(trajectory.excitation_values), 1)
    rotates = _rotates(trajectory)
    rms = trajectory.tracking_error_rms()[rotates]
    tracks = trajectory.method != "static" and rms.size
    return {
        "rms_error_deg": math.degrees(math.sqrt((rms**2).mean())) if tracks else None,
        "cpu_s": cpu_time,
        "recruitments_per_step": (counts.recruitments - 1) / windows,
        "window_integrations_per_step": counts.window_integrations / windows,
        "newton_iterations_per_step": counts.newton_iterations / max(counts.steps, 1),
        "max_unmet_torque": trajectory.max_unmet_torque,
        "max_constraint_drift": trajectory.max_constraint_drift,
    }


def excitation_difference(one: Trajectory, other: Trajectory) -> float:
    """Largest difference in the middle of the windows of `other`."""
    times = 0.5 * (other.window_time[1:] + other.window_time[:-1])
    first, second = one.excitations, other.excitations
    gaps = [abs(first.values[first.window(t)] - second.values[second.window(t)]) for t in times]
    return float(max(gap.max() for gap in gaps))


def _rotates(trajectory: Trajectory) -> np.ndarray:
    """Which coordinates are angles, (n,) of bool."""
    return np.array(trajectory.coordinate_units) == "rad"


def _number(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def exit_status(trajectory: Trajectory) -> int:
    """Exit status of a run; one that was stopped early is not a success."""
    if trajectory.status is Status.COMPLETE:
        return 0
    how = "has lost the motion" if trajectory.status is Status.LOST else "is incomplete"
    text = f"{METHODS[trajectory.method]} {how}: {trajectory.message}"
    print(f"{PROGRAM}: error: {text}", file=sys.stderr)
    return FAILED


def finite(value: Any) -> Any:
    """JSON knows neither NaN nor infinity: null."""
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
