"""What is wrong with a system whose equations cannot be solved, by the names of its items."""

from __future__ import annotations

from collections.abc import Sequence

import exudyn as exu
import numpy as np

from ...errors import ModelError

# Smallest singular value over the largest. Equations of bodies of 1 g to 100 kg have 1e-9.
SINGULAR = 1e-13
# Of the constraints alone, which have no masses in them.
REDUNDANT = 1e-10
# What a unit of force does to a body of 10 t, which no skeleton has: far less is rounding.
FREE = 1e-4
# Share in a singular direction from which an item is named.
SHARE = 0.1
# Movement of a coordinate under its own force, over that of a body without joints.
IMMOBILE = 1e-10


def explain_singular(mbs: exu.MainSystem, K: np.ndarray, n: int) -> None:
    """Raise ModelError if the equations with [[M, G^T], [G, D]], M (n, n), have no solution."""
    constraints = K[n:]
    if constraints.size:
        left, values, _ = np.linalg.svd(constraints)
        spare = values.size < len(constraints) or values[-1] <= REDUNDANT * values[0]
        if spare:
            share = np.abs(left[:, -1])
            raise ModelError(
                "constraints of the mbs are redundant, so that their forces are not determined: "
                f"{_named(mbs, np.flatnonzero(share > SHARE * share.max()))}; leave axes free that "
                "others lock already"
            )
    _, values, right = np.linalg.svd(K)
    if values[-1] <= SINGULAR * values[0]:
        share = np.abs(right[-1, :n])
        nodes = [
            f"node {k} '{mbs.GetNode(k)['name']}'"
            for k in range(mbs.systemData.NumberOfNodes())
            if share[mbs.systemData.GetNodeLTGODE2(k)].max(initial=0.0) > SHARE * share.max()
        ]
        raise ModelError(
            "the mass matrix is singular where the constraints leave the system free: check masses "
            f"and inertias at {', '.join(nodes)}"
        )


def _named(mbs: exu.MainSystem, equations: np.ndarray) -> str:
    """The objects that have these algebraic equations."""
    data, found = mbs.systemData, []
    for number in range(data.NumberOfObjects()):
        if set(data.GetObjectLTGAE(number)) & set(equations.tolist()):
            item = mbs.GetObject(number)
            found.append(f"object {number} '{item['name']}', a {item['objectType']}")
    return "; ".join(found)


def check_mobility(names: Sequence[str], T: np.ndarray, W: np.ndarray) -> None:
    """Raise ModelError unless the forces T^T (N, n), which accelerate the system by W (N, n), can
    move each tracked coordinate on its own."""
    mobility = T @ W
    for j, name in enumerate(names):
        if not np.abs(W[:, j]).max() > IMMOBILE * np.abs(W).max(initial=FREE):
            raise ModelError(f"coordinate '{name}': nothing can move it, the constraints hold it")
    scale = np.sqrt(np.abs(np.diag(mobility)))
    values, vectors = np.linalg.eigh(mobility / np.outer(scale, scale))
    if values[0] < IMMOBILE:
        share = np.abs(vectors[:, 0])
        same = [f"'{names[j]}'" for j in np.flatnonzero(share > SHARE * share.max()).tolist()]
        raise ModelError(
            f"coordinates {', '.join(same)} move only together: track one of them, the others "
            "follow by the constraints"
        )
