"""The command line: `exudyn-muscles run`, `cmc`, `compare`, `check` and `curves`.

Angles are in degrees here and nowhere else in the package. What is slow to import is imported by
the function that needs it, so that --help is quick.
"""

from .main import main

__all__ = ["main"]
