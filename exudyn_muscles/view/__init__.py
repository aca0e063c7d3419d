"""Muscles in Exudyn's renderer: solution viewer, interactive view and pictures."""

from .colors import UNKNOWN, activation_color
from .picture import render
from .viewer import show_muscles, solution, view

__all__ = ["UNKNOWN", "activation_color", "render", "show_muscles", "solution", "view"]
