"""How much of an outcome is due to which parameter: Morris' and Sobol's indices, by SALib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import StudyError
from .samples import Samples, problem

if TYPE_CHECKING:
    import pandas

CONFIDENCE = 0.95


def indices(samples: Samples, table: pandas.DataFrame, outcome: str) -> pandas.DataFrame:
    """Indices of all parameters, a row each.

    Parameters
    ----------
    samples : Samples
        Of `morris_design` or `sobol_design`.
    table : pandas.DataFrame
        The study's, of one source.
    outcome : str
        A column of it.

    Returns
    -------
    pandas.DataFrame
        `mu`, `mu_star`, `sigma` of the elementary effects, in the outcome's unit over a parameter's
        whole range, or Sobol's first and total indices `S1` and `ST`; with half of their intervals
        of 95 % confidence as `..._conf`.

    Raises
    ------
    StudyError
        The samples are of no such design, or of some run there is no outcome; names it.
    """
    import pandas

    if outcome not in table.columns:
        raise StudyError(f"the table has no outcome '{outcome}'")
    y = table[outcome].to_numpy(dtype=float)
    if y.size != len(samples):
        raise StudyError(f"{y.size} runs are not those of {len(samples)} samples of one source")
    missing = np.flatnonzero(~np.isfinite(y))
    if missing.size:
        k = missing[0]
        raise StudyError(
            f"indices of '{outcome}': {missing.size} runs have none, the first of them run {k}: "
            f"{table['status'].iloc[k]} {table['message'].iloc[k]}".rstrip()
        )
    if np.ptp(y) == 0.0:
        raise StudyError(f"indices of '{outcome}': it is {y[0]:g} in all runs")
    unit = problem(dict.fromkeys(samples.names, (0.0, 1.0)))
    if samples.design == "sobol":
        from SALib.analyze import sobol

        found = sobol.analyze(
            unit, y, calc_second_order=False, conf_level=CONFIDENCE, seed=samples.seed
        )
        columns = ("S1", "S1_conf", "ST", "ST_conf")
    elif samples.design == "morris":
        from SALib.analyze import morris

        low, high = np.array([samples.ranges[name] for name in samples.names], dtype=float).T
        x = (samples.values - low) / (high - low)
        found = morris.analyze(unit, x, y, conf_level=CONFIDENCE, seed=samples.seed)
        columns = ("mu", "mu_star", "mu_star_conf", "sigma")
    else:
        raise StudyError("indices need samples of sobol_design or morris_design")
    rows = {name: np.asarray(found[name], dtype=float) for name in columns}
    frame = pandas.DataFrame(rows, index=pandas.Index(samples.names, name="parameter"))
    frame.attrs["outcome"] = outcome
    return frame
