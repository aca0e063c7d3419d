"""The command line: `exudyn-muscles run`, `cmc`, `compare`, `check`, `curves`, `study`.

Angles are in degrees here and nowhere else in the package.
"""

from .main import main

__all__ = ["main"]
