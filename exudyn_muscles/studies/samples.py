"""What is drawn: values of parameters, a run in a row."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..errors import StudyError
from .parameters import check_name

if TYPE_CHECKING:
    import pandas

Ranges = Mapping[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Samples:
    """Values of p parameters for k runs.

    Attributes
    ----------
    names : tuple of str
        As `studies.parameters` says.
    values : (k, p) ndarray
    ranges : mapping
        Name -> lowest and highest value, of what was drawn; empty for what was given.
    design : str
        By which indices follow from the runs: `morris`, `sobol`, or empty.
    seed : int
        It was drawn with.

    Raises
    ------
    StudyError
        Names that are no parameters, shapes that do not fit, or values that are no numbers.
    """

    names: tuple[str, ...]
    values: np.ndarray
    ranges: Ranges = field(default_factory=dict)
    design: str = ""
    seed: int = 0

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=float)
        if values.ndim != 2 or values.shape[1] != len(self.names):
            raise StudyError(
                f"samples: values {values.shape} do not fit {len(self.names)} parameters"
            )
        for name in self.names:
            check_name(name)
        if len(set(self.names)) < len(self.names):
            raise StudyError(f"samples: a parameter is there twice in {', '.join(self.names)}")
        rows, columns = np.nonzero(~np.isfinite(values))
        if rows.size:
            raise StudyError(
                f"samples: '{self.names[columns[0]]}' of run {rows[0]} is "
                f"{values[rows[0], columns[0]]}"
            )
        values.setflags(write=False)
        object.__setattr__(self, "values", values)

    def __len__(self) -> int:
        return len(self.values)

    @classmethod
    def single(cls) -> Samples:
        """One run with everything as it is.

        Returns
        -------
        Samples
        """
        return cls((), np.empty((1, 0)))

    @classmethod
    def from_dataframe(cls, frame: pandas.DataFrame) -> Samples:
        """Columns are parameters, rows are runs.

        Parameters
        ----------
        frame : pandas.DataFrame

        Returns
        -------
        Samples

        Raises
        ------
        StudyError
            A value is no number, or a column no parameter.
        """
        try:
            values = frame.to_numpy(dtype=float)
        except (TypeError, ValueError) as error:
            raise StudyError(f"samples: {error}") from None
        return cls(tuple(map(str, frame.columns)), values)


def latin_hypercube(ranges: Ranges, count: int, seed: int = 0) -> Samples:
    """Points of which each part of a parameter's range has one (SciPy's `qmc.LatinHypercube`).

    Parameters
    ----------
    ranges : mapping
        Name of a parameter -> lowest and highest value.
    count : int
        Of points, and of parts of every range.
    seed : int

    Returns
    -------
    Samples

    Raises
    ------
    StudyError
        A range is none.
    """
    from scipy.stats import qmc

    return _scaled(ranges, qmc.LatinHypercube(len(ranges), rng=seed).random(count), seed=seed)


def sobol_sequence(ranges: Ranges, count: int, seed: int = 0) -> Samples:
    """Points of Sobol's scrambled sequence (SciPy's `qmc.Sobol`).

    Parameters
    ----------
    ranges : mapping
        Name of a parameter -> lowest and highest value.
    count : int
        Of points; a power of 2.
    seed : int

    Returns
    -------
    Samples

    Raises
    ------
    StudyError
        A range is none, or the count no power of 2.
    """
    from scipy.stats import qmc

    _check_power_of_two(count)
    return _scaled(ranges, qmc.Sobol(len(ranges), rng=seed).random(count), seed=seed)


def morris_design(ranges: Ranges, trajectories: int, seed: int = 0) -> Samples:
    """Points for Morris' elementary effects (SALib).

    Parameters
    ----------
    ranges : mapping
        Name of a parameter -> lowest and highest value.
    trajectories : int
        Ways through the ranges, of p + 1 points each with p parameters.
    seed : int

    Returns
    -------
    Samples

    Raises
    ------
    StudyError
        A range is none.
    """
    from SALib.sample import morris

    unit = morris.sample(problem(_unit(ranges)), trajectories, seed=seed)
    return _scaled(ranges, unit, "morris", seed)


def sobol_design(ranges: Ranges, count: int, seed: int = 0) -> Samples:
    """Points for Sobol's first and total indices (SALib).

    Parameters
    ----------
    ranges : mapping
        Name of a parameter -> lowest and highest value.
    count : int
        A power of 2; there are `count` (p + 2) points with p parameters.
    seed : int

    Returns
    -------
    Samples

    Raises
    ------
    StudyError
        A range is none, or the count no power of 2.
    """
    from SALib.sample import sobol

    _check_power_of_two(count)
    unit = sobol.sample(problem(_unit(ranges)), count, calc_second_order=False, seed=seed)
    return _scaled(ranges, unit, "sobol", seed)


def problem(ranges: Ranges) -> dict:
    """The parameters as SALib describes them."""
    bounds = [list(pair) for pair in ranges.values()]
    return {"num_vars": len(ranges), "names": list(ranges), "bounds": bounds}


def _unit(ranges: Ranges) -> Ranges:
    return dict.fromkeys(ranges, (0.0, 1.0))


def _scaled(ranges: Ranges, unit: np.ndarray, design: str = "", seed: int = 0) -> Samples:
    for name, (low, high) in ranges.items():
        if not low < high:
            raise StudyError(f"parameter '{name}': from {low!r} to {high!r} is no range")
    low, high = np.array(list(ranges.values()), dtype=float).T
    return Samples(tuple(ranges), low + unit * (high - low), dict(ranges), design, seed)


def _check_power_of_two(count: int) -> None:
    if count < 1 or count & (count - 1):
        raise StudyError(f"{count} points of Sobol's sequence: a power of 2 was expected")
