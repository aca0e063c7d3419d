"""`exudyn-muscles check`: a stored result against a stored reference."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from ..results.trajectory import Trajectory
from .names import DIFFER


def check(arguments: argparse.Namespace) -> int:
    """A stored result against a stored reference."""
    result = Trajectory.load(arguments.result)
    reference = Trajectory.load(arguments.reference)
    difference = result.compare(reference, dict(arguments.tolerance))
    verdict = "agrees with" if difference is None else "differs from"
    why = "" if difference is None else f": {difference}"
    print(f"{arguments.result} {verdict} {arguments.reference}{why}")
    _tell_others("settings", result.settings, reference.settings)
    if difference is not None:
        _tell_others("versions", result.versions, reference.versions)
    return 0 if difference is None else DIFFER


def _tell_others(what: str, found: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    other = [
        f"{name} {found.get(name)} instead of {value}"
        for name, value in wanted.items()
        if found.get(name) != value
    ]
    if other:
        print(f"other {what} than the reference's: {', '.join(other)}")
