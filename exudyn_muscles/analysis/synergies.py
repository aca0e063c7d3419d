"""Modes along which muscles work together, from activations."""

from __future__ import annotations

import numpy as np

from ..checks import number_within
from ..errors import ParameterError
from ..results.trajectory import Trajectory

MOST_STEPS, CLOSE = 5000, 1e-8  # of the factorization


def fit_synergies(result: Trajectory, count: int) -> dict[str, tuple[float, ...]]:
    """Modes W of at least zero whose sums with amplitudes H of at least zero come nearest to the
    activations of a result, by scikit-learn's NMF.

    D. D. Lee and H. S. Seung, "Learning the parts of objects by non-negative matrix factorization",
    Nature 401 (1999).

    Parameters
    ----------
    result : Trajectory
        Its activations.
    count : int
        Number of modes, at most as many as there are muscles.

    Returns
    -------
    dict of str to (count,) tuple of float
        Of every muscle, as `Synergies` takes them; the largest value of each mode is one.

    Raises
    ------
    ParameterError
        `count` is outside its range.
    ImportError
        scikit-learn is not installed (`pip install exudyn_muscles[analysis]`).
    """
    from sklearn.decomposition import NMF  # slow to import

    m = len(result.muscle_names)
    if not m:
        raise ParameterError("the result has no muscles")
    number_within("count", count, 1, m)
    if count != int(count):
        raise ParameterError(f"count = {count} is no whole number")
    factors = NMF(int(count), init="nndsvda", max_iter=MOST_STEPS, tol=CLOSE, random_state=0)
    factors.fit(np.maximum(result.activations, 0.0))
    W = factors.components_ / factors.components_.max(axis=1, keepdims=True)
    return {name: tuple(map(float, W[:, i])) for i, name in enumerate(result.muscle_names)}
