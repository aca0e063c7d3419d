"""What `asv` runs with every version: CPU times of whole runs, of a step's parts, of the start.

Each is the least of several. The package is the one that is installed where they run, models and
cases are this checkout's.
"""

import sys
from pathlib import Path

import exudyn_muscles  # before the checkout, which has one as well, can be imported from  # noqa: F401

sys.path.append(str(Path(__file__).parents[3]))
