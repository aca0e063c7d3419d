"""External forces on the links of a tree, as generalized forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..numerics.kernel import kernel
from ..path.frames import turned
from ..path.pulls import FORCE, ON_LINK, PULL_COLUMNS
from .external import ExternalForce, cubics
from .jacobian import ON_LINK_AS_TORQUE, add_generalized

LINK, FORCE_FRAME, POINT_FRAME, HAS_POINT = range(4)
FORCE_SAMPLE, POINT_SAMPLE, TORQUE_SAMPLE = slice(0, 3), slice(3, 6), slice(6, 9)
MARGIN = 1e-9  # s, accumulated time steps


class RecordTable(NamedTuple):
    """Records one after the other.

    `links` (r, 4) are on which link, in whose frames force and point are, and whether there is a
    point; record i has the samples `starts[i]` to `starts[i + 1]` of `times` (k,) [s], and from
    each of them on its cubic in `pieces` (k, 4, 9).
    """

    links: np.ndarray
    starts: np.ndarray
    times: np.ndarray
    pieces: np.ndarray


def record_table(records: Sequence[ExternalForce]) -> RecordTable:
    """At least one record as a table."""
    last = np.zeros((1, 4, 9))
    return RecordTable(
        np.array([
            [r.link, r.force_expressed_in, r.point_expressed_in, r.point is not None]
            for r in records
        ], dtype=np.int64),
        np.cumsum([0] + [r.times.size for r in records]),
        np.concatenate([r.times for r in records]),
        np.concatenate([piece for r in records for piece in (cubics(r), last)]),
    )  # fmt: skip


@kernel(allocates=True)
def add_external_forces(joints, parents, R, p, axes, links, starts, times, pieces, t, Q):
    """Add the forces of a `RecordTable` at the time `t` to Q (n,) of a tree, whose links have the
    frames R, p, axes; outside of its samples a record has none."""
    sample, at, values = np.empty(9), np.empty(3), np.empty(PULL_COLUMNS)
    for i in range(links.shape[0]):
        first, last = starts[i], starts[i + 1] - 1
        if not times[first] - MARGIN <= t <= times[last] + MARGIN:
            continue
        k = first + np.searchsorted(times[first : last + 1], t, side="right") - 1
        k = min(max(k, first), last - 1)
        s = t - times[k]
        for c in range(9):
            piece = pieces[k, :, c]
            sample[c] = ((piece[0] * s + piece[1]) * s + piece[2]) * s + piece[3]
        link, force_frame, at_frame = links[i, LINK], links[i, FORCE_FRAME], links[i, POINT_FRAME]
        if links[i, HAS_POINT]:
            turned(R, at_frame, sample[POINT_SAMPLE], at)
            if at_frame >= 0:
                at += p[at_frame]
        else:
            at[:] = p[link]
        values[:FORCE] = at
        turned(R, force_frame, sample[FORCE_SAMPLE], values[FORCE:])
        add_generalized(joints, parents, p, axes, ON_LINK, link, values, Q)
        turned(R, force_frame, sample[TORQUE_SAMPLE], values[FORCE:])
        add_generalized(joints, parents, p, axes, ON_LINK_AS_TORQUE, link, values, Q)
