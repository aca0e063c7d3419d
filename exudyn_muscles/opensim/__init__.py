"""Models of OpenSim: `.osim` files as Exudyn systems with muscles, set-ups, and files of results.

What in a file is damaged or cannot be represented here is refused by name, with its line: whatever
reads an element of a file raises ModelFileError for it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
