from . import result_files
from .cmc_setup import CMCSetup
from .joints import Coordinate
from .load import load_model, read_coordinates
from .meshes import load_meshes
from .result_files import write_results
from .setup import load_setup
from .static_setup import StaticSetup

__all__ = [
    "CMCSetup",
    "Coordinate",
    "StaticSetup",
    "load_meshes",
    "load_model",
    "load_setup",
    "read_coordinates",
    "result_files",
    "write_results",
]
