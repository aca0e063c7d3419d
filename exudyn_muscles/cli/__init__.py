"""The command line: `exudyn-muscles run`, `cmc`, `compare`, `check` and `curves`.

Angles are in degrees here and nowhere else in the package.
"""

from .main import main

__all__ = ["main"]
