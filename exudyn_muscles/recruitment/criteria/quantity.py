"""What of a muscle a criterion counts: its force, its excitation or its activation."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np

from ..demand import Demand

# Of a normalising force, and its inverse: what activations do beyond is hardly a choice.
NARROW = 1e-3


class Quantity(Enum):
    """What of a muscle is counted; of ideal actuators it is always the force over the optimal one.

    At a window's end a force F goes with an excitation and an activation; both are taken as linear
    in F between those of the least and the largest force within reach. With a rigid tendon the
    activation is; `docs/recruitment.md` tells how far it is from that with elastic ones.
    """

    FORCE = "force over the normalising force"
    EXCITATION = "excitation"
    ACTIVATION = "activation"


class Counted(NamedTuple):
    """A demand with unknowns x = F / N in which the quantity is `size` (x - `zero`), (m,) each."""

    demand: Demand
    zero: np.ndarray
    size: np.ndarray


def counted(quantity: Quantity, demand: Demand) -> Counted:
    """The demand in units of a quantity. Weights w of muscles are within: x - zero is w^1/2 times
    the quantity."""
    zero, size = np.zeros(demand.N.size), np.ones(demand.N.size)
    k = demand.cheaper.size
    size[:k] = demand.cheaper
    if quantity is Quantity.FORCE:
        return Counted(demand, zero, size)
    low, high = demand.excitation if quantity is Quantity.EXCITATION else demand.activation
    F_min, N = demand.F_min[:k], demand.N.copy()
    room, width = demand.F_max[:k] - F_min, high - low
    per_unit = np.divide(room, width, out=np.zeros(k), where=(width > 0.0) & (room > 0.0))
    N[:k] = np.clip(per_unit * demand.cheaper, NARROW * N[:k], N[:k] / NARROW)
    zero[:k] = F_min / N[:k] - low / demand.cheaper
    return Counted(demand._replace(N=N), zero, size)
