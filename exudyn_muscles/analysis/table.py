"""Named columns with units over time: what every analysis returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ParameterError
from ..files.storage import Storage

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False)
class Table:
    """c columns over k times.

    Attributes
    ----------
    name : str
    time : (k,) ndarray
        [s].
    columns : tuple of str
        `quantity/muscle`, `quantity/coordinate` or `quantity/coordinate/muscle`.
    units : tuple of str
        Of the columns; empty for ratios.
    values : (k, c) ndarray
    """

    name: str
    time: np.ndarray
    columns: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray

    def __getitem__(self, column: str) -> np.ndarray:
        """A column (k,), or all those of a quantity (k, columns of it).

        Raises
        ------
        ParameterError
            There is no such column or quantity; lists the quantities.
        """
        if column in self.columns:
            return self.values[:, self.columns.index(column)]
        chosen = [i for i, name in enumerate(self.columns) if name.startswith(f"{column}/")]
        if not chosen:
            quantities = dict.fromkeys(name.split("/")[0] for name in self.columns)
            raise ParameterError(
                f"{self.name}: no column or quantity '{column}', only {', '.join(quantities)}"
            )
        return self.values[:, chosen]

    def to_dataframe(self) -> pandas.DataFrame:
        """Times as rows; units are in its `attrs["units"]`.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        ImportError
            pandas is not installed.
        """
        import pandas

        index = pandas.Index(self.time, name="time")
        frame = pandas.DataFrame(self.values, index=index, columns=list(self.columns))
        frame.attrs["units"] = dict(zip(self.columns, self.units, strict=True))
        return frame

    def to_storage(self) -> Storage:
        """The same as a storage file, for `Storage.write`.

        Returns
        -------
        Storage
        """
        return Storage(self.name, self.columns, self.time, self.values)


def tabulated(
    name: str, time: np.ndarray, parts: Mapping[str, tuple[str, tuple[str, ...], np.ndarray]]
) -> Table:
    """A table of quantities, each with its unit, the names behind it, and values (k, names)."""
    columns = [f"{quantity}/{x}" for quantity, (_, names, _) in parts.items() for x in names]
    units = [unit for unit, names, _ in parts.values() for _ in names]
    values = np.concatenate([values for _, _, values in parts.values()], axis=1)
    return Table(name, time, tuple(columns), tuple(units), values)
