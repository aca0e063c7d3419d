"""Colors of what is drawn, RGB; muscles are colored by their activation."""

from __future__ import annotations

import math

RELAXED = (0.13, 0.30, 0.90)  # a = 0
ACTIVE = (0.90, 0.10, 0.10)  # a = 1
UNKNOWN = (0.62, 0.42, 0.42)  # of a muscle whose activation is not known
BONE = (0.80, 0.77, 0.70)
TENDON = (0.93, 0.90, 0.82)
FLESH = (0.93, 0.74, 0.64)
SURFACE = (0.55, 0.70, 0.75)
FLESH_OPACITY, SURFACE_OPACITY = 0.16, 0.45


def activation_color(activation: float) -> tuple[float, float, float, float]:
    """RGBA from blue, a = 0, to red, a = 1; a brownish gray if it is NaN.

    Parameters
    ----------
    activation : float

    Returns
    -------
    tuple of four float

    Examples
    --------
    >>> activation_color(1.0)
    (0.9, 0.1, 0.1, 1.0)
    """
    if math.isnan(activation):
        return (*UNKNOWN, 1.0)
    share = min(max(float(activation), 0.0), 1.0)
    r, g, b = (
        (1.0 - share) * low + share * high for low, high in zip(RELAXED, ACTIVE, strict=True)
    )
    return (r, g, b, 1.0)
