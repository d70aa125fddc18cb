"""What ``run`` of every filter returns: :class:`Result`, columns of a record as NumPy arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False, eq=False)
class Result:
    """Base of the results: a frozen dataclass whose fields are the columns.

    A column is an array whose first axis is time: row k is the state of affairs after row k of the
    record. All have the same length, which is ``len(result)``. A column that was not asked for is
    None to the constructor and no attribute of the result.

    ``result.nis`` and ``result["nis"]`` are the same array. A subclass gives its fields no default.
    """

    _length_of = "rows"

    def __post_init__(self) -> None:
        for field in fields(self):
            if self.__dict__[field.name] is None:
                object.__delattr__(self, field.name)
        rows = {name: len(self.__dict__[name]) for name in self.columns}
        if len(set(rows.values())) > 1:
            raise ValueError(f"columns differ in length: {rows}")

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns that are there."""
        return tuple(field.name for field in fields(self) if field.name in self.__dict__)

    def __len__(self) -> int:
        return len(self.__dict__[self.columns[0]])

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        if name not in self.columns:
            raise KeyError(self._no_column(name))
        return self.__dict__[name]

    if not TYPE_CHECKING:  # checkers of types would take any name for a column

        def __getattr__(self, name: str) -> Any:  # only where there is no such attribute
            raise AttributeError(self._no_column(name))

    def to_pandas(self, columns: Iterable[str] | None = None) -> pd.DataFrame:
        """Make a pandas DataFrame, one row per row of the record.

        An array of more axes becomes one column per element, named after its place: ``x[:, 0]`` is
        ``x_0``, ``P[:, 0, 1]`` is ``P_0_1``. A column ``time_s`` becomes the index.

        Parameters
        ----------
        columns : iterable of str, optional
            Names of the columns to take; default: all that are there.

        Raises
        ------
        KeyError
            If there is no such column.
        ModuleNotFoundError
            If pandas is not installed.
        """
        try:
            import pandas as pd
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(
                "to_pandas() needs pandas, which is not installed: pip install pandas"
            ) from error
        data = {}
        for name in self.columns if columns is None else columns:
            column = self[name]
            for place in np.ndindex(column.shape[1:]):
                data["_".join((name, *map(str, place)))] = column[(slice(None), *place)]
        index = None
        if "time_s" in self.columns:
            data.pop("time_s", None)
            index = pd.Index(self["time_s"], name="time_s")
        return pd.DataFrame(data, index=index)

    def __repr__(self) -> str:
        shapes = ", ".join(f"{name} {self[name].shape}" for name in self.columns)
        return f"{type(self).__name__}({self._summary()}: {shapes})"

    def _repr_html_(self) -> str:
        """Show in a notebook what there is, with the last row."""
        lines = [
            f"<tr><th>{name}</th><td>{self[name].shape}</td><td>{self[name].dtype}</td>"
            f"<td>{_last(self[name])}</td></tr>"
            for name in self.columns
        ]
        return (
            f"<table><caption>{type(self).__name__}, {self._summary()}</caption>"
            "<thead><tr><th>column</th><th>shape</th><th>dtype</th><th>last row</th></tr></thead>"
            f"<tbody>{''.join(lines)}</tbody></table>"
        )

    def _summary(self) -> str:
        """Say in a few words what the rows are."""
        return f"{len(self)} {self._length_of}"

    def _no_column(self, name: str) -> str:
        there = f"{type(self).__name__} has {', '.join(self.columns)}"
        if any(field.name == name for field in fields(self)):
            return f"{name} was not asked for: this {there}"
        return f"there is no {name}: this {there}"


def _last(column: npt.NDArray[Any]) -> str:
    if len(column) == 0:
        return ""
    if column[-1].size > 6:  # a covariance would fill the page
        return "&hellip;"
    return np.array2string(column[-1], precision=4, separator=", ")
