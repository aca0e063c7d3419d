"""Names that have moved; they warn, and will be gone with the next version."""

from typing import Any

from .errors import warn
from .files import storage as _files
from .opensim import result_files as _results

# Old name -> where it is now.
_RESULTS = "exudyn_muscles.opensim.result_files"
_MOVED = {
    "Storage": (_files, "exudyn_muscles"),
    "read_storage": (_files, "exudyn_muscles"),
    "write_results": (_results, "exudyn_muscles.opensim"),
    "states": (_results, _RESULTS),
    "kinematics": (_results, _RESULTS),
    "controls": (_results, _RESULTS),
    "forces": (_results, _RESULTS),
    "tracking_errors": (_results, _RESULTS),
}


def __getattr__(name: str) -> Any:
    if name not in _MOVED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, place = _MOVED[name]
    warn(f"exudyn_muscles.storage.{name} is now {place}.{name}", DeprecationWarning)
    return getattr(module, name)
