"""What user functions change in an `mbs` is put back after a run, so that none depends on the run
before."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from numbers import Number
from typing import Any, NamedTuple

import exudyn as exu
import numpy as np

from ..skeleton.hold import Hold


class Parameter(NamedTuple):
    """A number, or several, of a load or an object."""

    kind: str
    item: int
    name: str


def keep_parameters(mbs: exu.MainSystem, held: Hold) -> None:
    """Note the numbers of all loads and objects; those that have changed are put back in the end.

    The user's `mbs.variables` stay as the run leaves them.
    """
    before = dict(_parameters(mbs))

    def put_back() -> None:
        for parameter, value in _parameters(mbs):
            if parameter in before and not np.array_equal(value, before[parameter]):
                kind, item, name = parameter
                getattr(mbs, f"Set{kind}Parameter")(item, name, before[parameter])

    held.keep(put_back)


def _parameters(mbs: exu.MainSystem) -> Iterator[tuple[Parameter, Any]]:
    data = mbs.systemData
    kinds: tuple[tuple[str, int, Callable[[int], dict]], ...] = (
        ("Load", data.NumberOfLoads(), mbs.GetLoad),
        ("Object", data.NumberOfObjects(), mbs.GetObject),
    )
    for kind, count, get in kinds:
        for item in range(count):
            for name, value in get(item).items():
                if isinstance(value, (Number, np.ndarray)) and not name.startswith("V"):
                    yield Parameter(kind, item, name), np.array(value)
