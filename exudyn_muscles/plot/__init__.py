"""Figures of results and of muscles."""

from .figures import (
    activations,
    comparison,
    curves,
    excitations,
    forces,
    muscle,
    tracking_errors,
)

__all__ = [
    "activations",
    "comparison",
    "curves",
    "excitations",
    "forces",
    "muscle",
    "tracking_errors",
]
