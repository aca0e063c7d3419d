"""The one helper for derivatives by differences."""

import numpy as np


def difference(function, x, step):
    """Derivative of `function` at the scalar `x`, fourth order, for array values too."""
    near = np.subtract(function(x + step), function(x - step))
    far = np.subtract(function(x + 2.0 * step), function(x - 2.0 * step))
    return (8.0 * near - far) / (12.0 * step)


def gradient(function, x, step):
    """Derivatives with respect to every entry of the vector `x`, along a new last axis."""
    columns = []
    for k in range(len(x)):
        direction = np.eye(len(x))[k]
        columns.append(difference(lambda s, d=direction: function(x + s * d), 0.0, step))
    return np.stack(columns, axis=-1)


def certified(function, x, scale):
    """Derivative of `function` at the scalar `x`, and how well differences over steps from 1e-3 to
    1e-6 of `scale` agree; where they do not, `x` is close to a kink."""
    steps = scale * np.array([1e-3, 2e-4, 4e-5, 8e-6, 1.6e-6])
    found = np.array([difference(function, x, step) for step in steps])
    apart = np.abs(np.diff(found))
    best = apart.argmin()
    return found[best + 1], apart[best]
