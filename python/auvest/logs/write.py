"""Writing the files of a log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from auvest._outputs import new_file
from auvest.logs.layout import FILES


def write_file(folder: Path, name: str, **columns: npt.ArrayLike) -> None:
    """Write one file of a log.

    Parameters
    ----------
    folder : Path
        The log's folder; made if missing.
    name : str
        Which file of the layout, for example ``"ranges.csv"``.
    **columns : array_like, shape (T,)
        The columns by name, as one of the layouts has them.

    Raises
    ------
    ValueError
        If the columns are not those of a layout, or hold what the reader would refuse; then nothing
        is written.
    """
    layout = next(
        (one for one in FILES[name] if {column.name for column in one} == set(columns)), None
    )
    if layout is None:
        known = [tuple(column.name for column in one) for one in FILES[name]]
        raise ValueError(f"{name} must have the columns {known}, not {list(columns)}")
    for column in layout:
        given = np.asarray(columns[column.name])
        good = column.takes(given)
        if not good.all():
            k = int(np.argmin(good))
            raise ValueError(
                f"{name}, row {k}, column {column.name}: {given[k]} is not {column.expected}"
            )
    folder.mkdir(parents=True, exist_ok=True)
    values = [np.asarray(columns[column.name]).tolist() for column in layout]
    with new_file(folder / name, "w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(column.name for column in layout) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in zip(*values, strict=True))
