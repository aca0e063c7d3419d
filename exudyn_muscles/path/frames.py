"""Frames of links, R (links, 3, 3) and p (links, 3), and what is fixed in them."""

from __future__ import annotations

from ..numerics.kernel import kernel

GROUND = -1  # in place of a link


@kernel
def turned(R, link, v, x):
    """Write a vector of a link's frame, or of ground, as x in ground."""
    for i in range(3):
        if link < 0:
            x[i] = v[i]
        else:
            x[i] = R[link, i, 0] * v[0] + R[link, i, 1] * v[1] + R[link, i, 2] * v[2]


@kernel
def point_positions(positions, links, R, p, x):
    """Write the global positions x (k, 3) of points on their links."""
    for k in range(links.size):
        link = links[k]
        for row in range(3):
            if link < 0:
                x[k, row] = positions[k, row]
            else:
                x[k, row] = (
                    p[link, row]
                    + R[link, row, 0] * positions[k, 0]
                    + R[link, row, 1] * positions[k, 1]
                    + R[link, row, 2] * positions[k, 2]
                )
