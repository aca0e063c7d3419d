"""Quadratic programs, as any solver can be asked for them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(eq=False)
class Program:
    """min x P x / 2 + q x subject to A x = b, G x <= h if there are such rows, and bounds on x."""

    P: np.ndarray
    q: np.ndarray
    A: np.ndarray
    b: np.ndarray
    lb: np.ndarray
    ub: np.ndarray
    G: np.ndarray | None = None
    h: np.ndarray | None = None
