from .colors import UNKNOWN, activation_color
from .picture import render
from .viewer import show_muscles, solution, view

__all__ = ["UNKNOWN", "activation_color", "render", "show_muscles", "solution", "view"]
