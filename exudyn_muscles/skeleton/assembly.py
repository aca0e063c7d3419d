"""Items that are added to an `mbs` that the user has assembled."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import exudyn as exu


@contextmanager
def assembled_anew(mbs: exu.MainSystem) -> Iterator[None]:
    """Items are added within; Exudyn assembles anew, and the state is as before."""
    data = mbs.systemData
    kinds = (exu.ConfigurationType.Initial, exu.ConfigurationType.Current)
    states = [(kind, data.GetSystemState(kind)) for kind in kinds]
    time = data.GetTime()
    yield
    mbs.Assemble()
    for kind, state in states:
        data.SetSystemState(state, kind)
    data.SetTime(time)
