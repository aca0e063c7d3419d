"""Nodes within a step: quadrature over it, and the cubic through the states at its ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import legendre

from ...skeleton.state import hermite


def lobatto(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (count,) of Lobatto's quadrature from 0 to 1.

    Examples
    --------
    >>> lobatto(3)[1] * 6
    array([1., 4., 1.])
    """
    last = np.eye(count)[-1]
    x = np.r_[-1.0, np.sort(legendre.legroots(legendre.legder(last))), 1.0]
    return 0.5 * (x + 1.0), 1.0 / (count * (count - 1) * legendre.legval(x, last) ** 2)


class Nodes:
    """Where in a step accelerations are taken, and what is made of them.

    Attributes
    ----------
    s : (k,) ndarray
        The nodes, as parts of the step.
    weights, moments : (k,) ndarray
        int x ds and int (1 - s) x ds of values x there.
    value, slope : (k, 4) ndarray
        As of `hermite`.
    smooth : (k, 4) ndarray
        Weights of values at the nodes `SMOOTH` in the polynomial through them.
    """

    def __init__(self, s: np.ndarray, weights: np.ndarray) -> None:
        self.s, self.weights, self.moments = s, weights, weights * (1.0 - s)
        self.value, self.slope = hermite(s)
        self.smooth = np.column_stack(
            [np.prod([(s - y) / (x - y) for y in SMOOTH if y != x], axis=0) for x in SMOOTH]
        )

    def away(
        self, h: float, start: Sequence[np.ndarray], end: Sequence[np.ndarray], a: np.ndarray
    ) -> np.ndarray:
        """q and h q' (2, N), by which accelerations `a` (k, N) over the step h [s] from q, q' at
        its start lead away from those at its end."""
        (q_0, v_0), (q_1, v_1) = start, end
        q = q_0 + h * (v_0 + h * (self.moments @ a)) - q_1
        return np.array([q, h * (v_0 + h * (self.weights @ a) - v_1)])


SMOOTH, _ = lobatto(4)  # nodes of M and H - Q, which are smoother than the muscles' force
NODES = Nodes(*lobatto(6))
