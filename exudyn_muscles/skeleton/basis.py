"""What the independent coordinates of a tree are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .closed import Closed
from .closures import Loops
from .coupling import DependentCoordinate
from .dependent import Dependent
from .independent import Independent
from .tree import Tree

Basis = Independent | Dependent | Closed


def basis_of(
    tree: Tree,
    names: Sequence[str],
    dependent: Sequence[DependentCoordinate],
    loops: Loops | None,
    near: np.ndarray,
) -> Basis:
    """That of a tree with coordinates of these names, in a pose `near` which its loops are closed.

    Raises
    ------
    ModelError, ParameterError
        As `Dependent` and `Closed`.
    """
    if loops is not None:
        return Closed(loops, dependent, tree, names, near)
    return Dependent(dependent, names) if dependent else Independent()
