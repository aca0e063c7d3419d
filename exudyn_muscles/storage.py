"""Names that have moved; they warn, and will be gone with the next version."""

import warnings
from typing import Any

from .files.storage import Storage, read_storage
from .opensim import result_files

OLD = {"Storage": Storage, "read_storage": read_storage}
NEW = {"Storage": "exudyn_muscles", "read_storage": "exudyn_muscles"}
for name in ("states", "kinematics", "controls", "forces", "tracking_errors"):
    OLD[name], NEW[name] = getattr(result_files, name), "exudyn_muscles.opensim.result_files"
OLD["write_results"], NEW["write_results"] = result_files.write_results, "exudyn_muscles.opensim"


def __getattr__(name: str) -> Any:
    if name not in NEW:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn(
        f"exudyn_muscles.storage.{name} is now {NEW[name]}.{name}", DeprecationWarning, stacklevel=2
    )
    return OLD[name]
