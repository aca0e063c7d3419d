"""What the curves of a page show, as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import ParameterError
from ..plot.styles import COLORS, styles
from ..results.trajectory import Trajectory
from .beside import Beside, Curves

MOST_ROWS = 600  # of a curve; longer ones are thinned evenly


def contents(
    trajectories: Sequence[Trajectory], groups: Mapping[str, Sequence[str]], beside: Beside
) -> dict[str, Any]:
    """Names and curves of trajectories of one model, ready for JSON."""
    first = trajectories[0]
    return {
        "colors": list(COLORS),
        "muscles": list(first.muscle_names),
        "groups": {name: list(members) for name, members in groups.items()},
        "coordinates": list(first.coordinate_names),
        "joints": list(beside.joints),
        "angles": [unit == "rad" for unit in first.coordinate_units],
        "results": [
            {"label": style.label, "status": one.status.name.lower(), **_curves(one, more)}
            for style, one, more in zip(
                styles(trajectories), trajectories, beside.curves, strict=True
            )
        ],
    }


def _curves(trajectory: Trajectory, more: Curves) -> dict[str, Any]:
    """Degrees and millimetres, N m and N."""
    points = _thinned(len(trajectory.time))
    windows = _thinned(trajectory.windows)
    loads = _thinned(len(more.load_time))
    angles = np.array(trajectory.coordinate_units) == "rad"
    errors = trajectory.tracking_errors()[points] * np.where(angles, np.degrees(1.0), 1e3)
    return {
        "time": _numbers(trajectory.time[points]),
        "ends": _numbers(trajectory.window_time[1:][windows]),
        "errors": _columns(errors),
        "activations": _columns(trajectory.activations[points]),
        "forces": _columns(trajectory.tendon_forces[points]),
        "excitations": _columns(trajectory.excitation_values[windows]),
        "low": _columns(trajectory.force_min[windows]),
        "high": _columns(trajectory.force_max[windows]),
        "unmet": _columns(trajectory.torques_unmet[windows]),
        "ideal": _columns(trajectory.torques_ideal[points]),
        "load_time": _numbers(more.load_time[loads]),
        "loads": _columns(more.loads[loads]),
        "least": _columns(more.least[windows]),
        "largest": _columns(more.largest[windows]),
        "measured": {
            trajectory.muscle_names.index(name): _numbers(values[windows])
            for name, values in more.measured.items()
        },
    }


def check_groups(trajectory: Trajectory, groups: Mapping[str, Sequence[str]]) -> None:
    """ParameterError if a group names a muscle that there is not."""
    for group, members in groups.items():
        unknown = [name for name in members if name not in trajectory.muscle_names]
        if unknown:
            raise ParameterError(
                f"groups: '{group}' names {', '.join(map(str, unknown))}; the muscles are "
                f"{', '.join(trajectory.muscle_names)}"
            )


def _thinned(count: int) -> np.ndarray:
    """Rows that are shown, the last one among them."""
    return np.unique(np.linspace(0, max(count - 1, 0), min(count, MOST_ROWS)).round().astype(int))


def _columns(values: np.ndarray) -> list[list[float | None]]:
    return [_numbers(column) for column in values.T]


def _numbers(values: np.ndarray) -> list[float | None]:
    """To five digits; None for what is not known, as JSON has no NaN."""
    return [float(f"{x:.5g}") if np.isfinite(x) else None for x in values]
