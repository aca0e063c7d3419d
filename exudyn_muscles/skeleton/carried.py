"""External forces on a tree while the plugin carries them.

At every residual Exudyn would ask for them in Python and find the motion of their markers, which
takes several times as long as all the rest of it. From the opening of a skeleton on they are
therefore part of the torques that Exudyn is given, and its own loads rest, unless somebody looks at
them or has changed them.
"""

from __future__ import annotations

import exudyn as exu
import numpy as np

from ..forces.external_loads import add_external_forces, record_table
from ..numerics.kernel import kernel
from .acting import Acting, carried_on_tree
from .hold import Hold
from .tree import Tree, link_frames


@kernel(allocates=True)
def external_torques(
    joints, parents, rotations, offsets, reference, links, starts, times, pieces, q, t, Q
):  # fmt: skip
    """Write what external forces are on the coordinates `q` (n,) at the time `t`, as Q (n,)."""
    n = q.size
    R, p, axes = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3))
    link_frames(joints, parents, rotations, offsets, reference, q, R, p, axes)
    Q[:] = 0.0
    add_external_forces(joints, parents, R, p, axes, links, starts, times, pieces, t, Q)


class Carrier:
    """External forces on a tree, by their loads, from `lay_down` to `take_up`."""

    def __init__(self, mbs: exu.MainSystem, loads: dict[int, Acting], tree: Tree) -> None:
        self._mbs, self._loads = mbs, loads
        records = {id(force): force.external_force for force in loads.values()}
        self._tables = *tree.tables(), *record_table(list(records.values()))
        self._torques = np.empty(len(tree))

    def __call__(self, q: np.ndarray, t: float) -> np.ndarray:
        """Their torques (N,) on all coordinates q (N,), overwritten by the next call."""
        if self._loads:
            external_torques(*self._tables, q, t, self._torques)
        return self._torques

    def lay_down(self) -> None:
        """Take them over."""
        for load, force in self._loads.items():
            force.lay_down(self._mbs, load)

    def take_up(self) -> None:
        """Give them back to Exudyn; nothing is carried from then on."""
        for load, force in self._loads.items():
            force.take_up(self._mbs, load)
        self._loads.clear()
        self._torques[:] = 0.0

    def check(self) -> None:
        """Raise ModelError if their loads do not rest any more."""
        for load, force in self._loads.items():
            force.check_rests(self._mbs, load)


def carry(mbs: exu.MainSystem, number: int, tree: Tree, held: Hold) -> Carrier | None:
    """Take the external forces on the tree with this object number over, if there are any."""
    loads = carried_on_tree(mbs, number)
    if not loads:
        return None
    carrier = Carrier(mbs, loads, tree)
    held.keep(carrier.take_up)
    carrier.lay_down()
    return carrier
