"""Muscle-driven forward dynamics and the muscle recruitment problem, as a plugin for Exudyn.

Names are imported when they are used: `__init__.pyi` says from where.
"""

from typing import Any

import lazy_loader

_lazily, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

# Names of the version before.
_RENAMED = {
    "CMC": "CMCSettings",
    "Cosimulation": "CosimulationSettings",
    "Forward": "ForwardSettings",
    "Static": "StaticSettings",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version(__name__)
    if name in _RENAMED:
        from .errors import warn

        warn(f"exudyn_muscles.{name} is now {_RENAMED[name]}", DeprecationWarning)
        return _lazily(_RENAMED[name])
    if name in __all__:
        return _lazily(name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
