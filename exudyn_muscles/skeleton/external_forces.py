"""External forces over time, such as a force plate's record, as loads of an Exudyn system.

A recorded force f, its point p and a free torque act on a link as a force at the origin o of the
link's frame and a torque about it,

    F = R_f f    T = (R_p p + o_p - o) x F + R_f tau,

with the pose o_p, R_p of the frame in which the point is given and the orientation R_f of that in
which the force is; both are ground or a link. Exudyn asks for F and T at every state that it
evaluates, so that they are part of Q in its own runs and in the inverse dynamics alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    LoadForceVector,
    LoadTorqueVector,
    MarkerBodyRigid,
    MarkerKinematicTreeRigid,
    ObjectGround,
    VObjectGround,
)

from ..checks import ItemNumber, MarkerNumber, check_link_exists
from ..errors import ParameterError
from ..forces.external import ExternalForce
from ..forces.external_loads import MARGIN
from ..path.frames import GROUND
from .acting import Acting, acting_in
from .reading import tree_item


def add_external_force(
    mbs: exu.MainSystem, tree: int | None, external_force: ExternalForce
) -> tuple[int, ...]:
    """Add an external force to an Exudyn system, before `mbs.Assemble()`.

    It becomes a `LoadForceVector`, a `LoadTorqueVector` or both at the origin of the link's frame,
    called `<name>: force` and `<name>: torque`, with user functions. While a method of this package
    runs it carries those of a tree itself, and the loads rest on ground, on an `ObjectGround` that
    is added if there is none; they are left to Exudyn, which takes several times as long, where
    they were changed, or a sensor of theirs or any user function of the `mbs` could look at them.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    tree : ObjectIndex or None
        Of the `ObjectKinematicTree`; None where the force's links are bodies or markers, by their
        ObjectIndex or MarkerIndex.
    external_force : ExternalForce

    Returns
    -------
    tuple of LoadIndex
        The loads.

    Raises
    ------
    ModelError
        The object is not a kinematic tree.
    ParameterError
        The tree lacks a link that the force names.
    exudyn.ModelError
        The system has loads of these names.
    """
    markers = _link_markers(mbs, tree, external_force)
    rest = None if tree is None else _resting_marker(mbs)
    acting = Acting(mbs, markers, rest, external_force)
    made = {
        "ForceVector": (LoadForceVector, "force"), "TorqueVector": (LoadTorqueVector, "torque")
    }  # fmt: skip
    items = [(*made[kind], function) for kind, function in acting.functions.items()]
    return tuple(
        mbs.AddLoad(
            kind(
                name=f"{external_force.name}: {what}",
                markerNumber=acting.markers[external_force.link],
                loadVector=[0.0, 0.0, 0.0],
                loadVectorUserFunction=function,
            )
        )
        for kind, what, function in items
    )


def check_external_forces(mbs: exu.MainSystem, start: float, end: float) -> float:
    """The time [s] at which the first record of an external force ends.

    Raises
    ------
    ParameterError
        One does not span `start` to `end` [s].
    """
    known = math.inf
    for number in range(mbs.systemData.NumberOfLoads()):
        acting = acting_in(mbs, number)
        if acting is None:
            continue
        name, times = acting.external_force.name, acting.external_force.times
        if start < times[0] - MARGIN or end > times[-1] + MARGIN:
            raise ParameterError(
                f"external force '{name}': its record spans [{times[0]:g}, {times[-1]:g}] s, the "
                f"run [{start:g}, {end:g}] s; where it is known to vanish, give it samples of zero"
            )
        known = min(known, float(times[-1]))
    return known


def external_forces_shown(mbs: exu.MainSystem) -> dict[str, Callable[[float], np.ndarray]]:
    """Functions of time for all external forces that have a force, by their names: where it acts
    [m] and what it is [N], (2, 3) in ground at Exudyn's visualization state."""
    found: dict[str, Callable[[float], np.ndarray]] = {}
    for number in range(mbs.systemData.NumberOfLoads()):
        acting = acting_in(mbs, number)
        if acting is not None and acting.external_force.force is not None:
            found[acting.external_force.name] = partial(acting.shown, mbs)
    return found


def _link_markers(
    mbs: exu.MainSystem, tree: int | None, external_force: ExternalForce
) -> dict[int, int]:
    """New markers at the origins of all links that a force names."""
    links = 0 if tree is None else len(tree_item(mbs, tree)["jointTypes"])
    named = {}
    for name in ("link", "force_expressed_in", "point_expressed_in"):
        what = f"external force '{external_force.name}': {name}"
        link = getattr(external_force, name)
        if link != GROUND:
            named[link] = what
            if tree is not None:
                check_link_exists(what, link, links)
            elif not isinstance(link, ItemNumber):
                raise ParameterError(
                    f"{what} = {link!r} is the ObjectIndex of a body or the MarkerIndex of a "
                    "marker where there is no tree"
                )
    return {link: _marker(mbs, tree, link, what) for link, what in named.items()}


def _resting_marker(mbs: exu.MainSystem) -> int:
    """A marker on ground, of all external forces."""
    for number in range(mbs.systemData.NumberOfLoads()):
        other = acting_in(mbs, number)
        if other is not None and other.rest is not None:
            return other.rest
    objects = range(mbs.systemData.NumberOfObjects())
    grounds = (k for k in objects if mbs.GetObject(k)["objectType"] == "Ground")
    ground = next(grounds, None)
    if ground is None:
        ground = mbs.AddObject(ObjectGround(visualization=VObjectGround(show=False)))
    return mbs.AddMarker(MarkerBodyRigid(bodyNumber=exu.ObjectIndex(int(ground))))


def _marker(mbs: exu.MainSystem, tree: int | None, link: int, what: str) -> int:
    if isinstance(link, MarkerNumber):
        return exu.MarkerIndex(int(link))
    if tree is not None:
        return mbs.AddMarker(MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link))
    try:
        mbs.GetObject(int(link))
    except Exception as error:
        raise ParameterError(f"{what}: the mbs has no object {int(link)}") from error
    return mbs.AddMarker(MarkerBodyRigid(bodyNumber=exu.ObjectIndex(int(link))))
