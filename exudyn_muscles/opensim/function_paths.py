"""Paths given by their length as a polynomial of coordinates."""

from __future__ import annotations

from ..path.functions import FunctionPath
from .bodies import Bodies
from .document import Element
from .functions import read_several, without_locked

# What OpenSim would take in place of the polynomial's own slopes.
OWN_SLOPES = ("moment_arm_functions", "lengthening_speed_function")


def read_function_path(element: Element, bodies: Bodies) -> FunctionPath:
    """A `FunctionBasedPath` whose length is a polynomial."""
    element.allow("coordinate_paths", "length_function", *OWN_SLOPES)
    for tag in OWN_SLOPES:
        own = element.find(tag)
        if own is not None and own.children:
            own.refuse()
    named = element.get("coordinate_paths")
    names = [path.rsplit("/", 1)[-1] for path in named.text.split()]
    known = {coordinate.name for coordinate in bodies.coordinates}
    for name in names:
        if name not in known:
            raise named.error(f"there is no coordinate '{name}'")
    length = read_several(element.object("length_function"), len(names))
    length, left = without_locked(length, names, bodies.locked)
    return FunctionPath(
        [
            (coefficient, {left[k]: power for k, power in powers.items()})
            for coefficient, powers in length.terms
        ]
    )
