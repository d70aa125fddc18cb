"""Writing the files of a log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

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
        If the columns are not those of a layout.
    """
    layouts = [tuple(column.name for column in layout) for layout in FILES[name]]
    names = next((layout for layout in layouts if set(layout) == set(columns)), None)
    if names is None:
        raise ValueError(f"{name} must have the columns {layouts}, not {list(columns)}")
    folder.mkdir(parents=True, exist_ok=True)
    values = [np.asarray(columns[column]).tolist() for column in names]
    with (folder / name).open("w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(names) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in zip(*values, strict=True))
