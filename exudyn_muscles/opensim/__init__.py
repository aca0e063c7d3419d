"""Models of OpenSim: `.osim` files as Exudyn systems with muscles, set-ups, and files of results.

What a file holds and cannot be represented here is refused by name, with its line.
"""

from . import result_files
from .joints import Coordinate
from .load import load_model, read_coordinates
from .result_files import write_results
from .setup import CMCSetup, load_setup

__all__ = [
    "CMCSetup",
    "Coordinate",
    "load_model",
    "load_setup",
    "read_coordinates",
    "result_files",
    "write_results",
]
