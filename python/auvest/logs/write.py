"""Writing the files of a log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from auvest._outputs import new_file
from auvest.logs.layout import COLUMNS, FILES, match


def write_file(folder: Path, name: str, **columns: npt.ArrayLike) -> None:
    """Write one file of a log.

    Parameters
    ----------
    folder : Path
        The log's folder; made if missing.
    name : str
        Which file of the layout, for example ``"ranges.csv"``.
    **columns : array_like, shape (T,)
        The columns by name, as one of the layouts has them, or in another spelling:
        ``latitude_deg`` and ``longitude_deg`` for ``x_m`` and ``y_m``, ``compass_rad`` for
        ``heading_rad``, ... Times are in seconds.

    Raises
    ------
    ValueError
        If the columns are not those of a layout, or hold what the reader would refuse; then nothing
        is written.
    """
    found = match(name, columns)
    if found is None or set(found.given) != set(columns):
        known = ", ".join(f"({layout})" for layout in FILES[name])
        raise ValueError(f"{name} must have the columns {known}, not {', '.join(columns)}")
    for column in (COLUMNS[one] for one in found.given):
        given = np.asarray(columns[column.name])
        good = column.takes(given)
        if not good.all():
            k = int(np.argmin(good))
            raise ValueError(
                f"{name}, row {k}, column {column.name}: {column.breach(float(given[k]))}"
            )
    folder.mkdir(parents=True, exist_ok=True)
    values = [np.asarray(columns[one]).tolist() for one in found.given]
    with new_file(folder / name, "w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(found.given) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in zip(*values, strict=True))
