"""External forces on a tree while the plugin carries them.

At every residual Exudyn would ask for them in Python and find the motion of their markers, which
takes several times as long as all the rest of it. From the opening of a skeleton on they are
therefore part of the torques that Exudyn is given, and its own loads rest.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import exudyn as exu
import numpy as np

from ..forces.external_loads import add_external_forces, record_table
from ..numerics.kernel import kernel
from .acting import acting_on_tree
from .hold import Hold
from .tree import Tree, link_frames

Carried = Callable[[np.ndarray, float], np.ndarray]


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


def carry(mbs: exu.MainSystem, number: int, tree: Tree, held: Hold) -> Carried | None:
    """Take the external forces on the tree with this object number over.

    Returns
    -------
    callable or None
        Their torques (N,) on all coordinates at q (N,) and t, overwritten by the next call; None if
        there are none.
    """
    acting = acting_on_tree(mbs, number)
    if not acting:
        return None
    for load, force in acting:
        held.keep(partial(force.take_up, mbs, load))
        force.lay_down(mbs, load)
    records = {id(force): force.external_force for _, force in acting}
    tables, torques = (*tree.tables(), *record_table(list(records.values()))), np.empty(len(tree))

    def carried(q: np.ndarray, t: float) -> np.ndarray:
        external_torques(*tables, q, t, torques)
        return torques

    return carried
