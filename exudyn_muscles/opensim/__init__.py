"""Models of OpenSim: `.osim` files as Exudyn systems with muscles.

What a file holds and cannot be represented here is refused by name, with its line.
"""

from .joints import Coordinate
from .load import load_model, read_coordinates
from .setup import CMCSetup, load_setup

__all__ = ["CMCSetup", "Coordinate", "load_model", "load_setup", "read_coordinates"]
