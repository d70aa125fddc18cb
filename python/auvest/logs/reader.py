"""Strict reading of a log: every complaint names file, line and column.

Files are read in chunks, so that memory does not grow with their length.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest._outputs import is_plain_file
from auvest._texts import other_cells
from auvest.logs.layout import COLUMNS, FILES, match, near
from auvest.logs.reading import Axes, FileReading, Reading, seconds_of, unit_of

Rows = npt.NDArray[np.float64]

#: What is wrong with a line that holds one.
CARRIAGE_RETURN = "has a carriage return within it: lines must end with LF or CRLF"
#: Lines read at once: a few megabytes, and long enough that the cost of a chunk does not count.
CHUNK_LINES = 32768
_LINE_BYTES = 40  # or so
#: Of fewer lines numbers are read without pyarrow, which takes longer to import.
FEW_LINES = 1000
#: What a name ends with that is in another unit than the layout's.
_OTHER_UNITS = frozenset(
    (
        "deg", "degrees", "deg_s", "rad", "rad_s", "min", "h", "s", "ms", "us", "ns", "m", "mm",
        "cm", "km", "ft", "m_s", "mm_s", "cm_s", "km_h", "kn", "knots",
    )
)  # fmt: skip
#: More than any file has that is read as a whole: beacons.csv, masters.csv and start.csv.
SMALL_FILE_LINES = 100_000
#: Files that no filter sees.
TRUTHS = ("truth.csv", "master_truth.csv")
#: Files that are of no use beside echoes.csv.
NOT_WITH_ECHOES = (
    "ranges.csv", "fixes.csv", "positions.csv", "velocities.csv", "depth.csv", "compass.csv",
    "beacons.csv", "leaders.csv",
)  # fmt: skip


class LogError(ValueError):
    """A log cannot be used as it is.

    Attributes
    ----------
    path : Path
        The file, or the folder if a file is missing.
    line : int or None
        Line of the file, counted from 1; None if the complaint is about the whole file.
    column : str or None
        Name of the column.
    cause : str
        What is wrong, one of :data:`auvest.logs.findings.CAUSES`.
    """

    def __init__(
        self,
        path: Path,
        message: str,
        *,
        line: int | None = None,
        column: str | None = None,
        cause: str = "unreadable",
    ) -> None:
        where = [str(path)]
        if line is not None:
            where.append(f"line {line}")
        if column is not None:
            where.append(f"column {column}")
        super().__init__(f"{', '.join(where)}: {message}")
        self.path = path
        self.line = line
        self.column = column
        self.cause = cause


class Frame:
    """Which way the axes of a log point, and where they begin on Earth.

    Parameters
    ----------
    axes : {"enu", "ned"}
        x east, y north, or x north, y east.

    Attributes
    ----------
    origin : tuple of float or None
        Latitude and longitude (deg) of (0, 0), of a log with places on Earth.
    """

    def __init__(self, axes: Axes = "enu") -> None:
        self.axes = axes
        self.origin: tuple[float, float] | None = None

    def sideways(self, left: Rows) -> Rows:
        """Turn a number that counts to the left into one from forward as +y from +x; and back."""
        return left if self.axes == "enu" else -left

    def from_north(self, clockwise: Rows) -> Rows:
        """Turn an angle clockwise from north into one from +x towards +y."""
        return clockwise if self.axes == "ned" else 0.5 * math.pi - clockwise

    def local(self, latitude_deg: Rows, longitude_deg: Rows) -> tuple[Rows, Rows]:
        """Give x and y (m) in the tangent plane of the origin."""
        from pymap3d import geodetic2enu  # here, because few logs need it

        assert self.origin is not None
        zero = np.zeros(len(latitude_deg))
        east, north, _ = geodetic2enu(latitude_deg, longitude_deg, zero, *self.origin, 0.0)
        return (east, north) if self.axes == "enu" else (north, east)


class CsvTable:
    """One file of a log.

    Parameters
    ----------
    path : Path
        The file.
    name : str, optional
        Which of :data:`auvest.logs.FILES` it is; default: that of its name.
    reading : FileReading, optional
        Names, units and separator, where they are not those of docs/logs.md.
    frame : Frame, optional
        Which way the axes point.

    Attributes
    ----------
    columns : tuple of Column
        The layout that the file has; rows come with their values in this order, in SI units and
        angles from +x towards +y. What a log counts to the left, rows count from forward as +y
        from +x, what it counts from north, they count from +x.
    ignored : list of str
        Columns of the file that are of no use.
    bytes : int
        Size of the file.
    bytes_read : int
        How much of it was read so far.

    Raises
    ------
    LogError
        If the file cannot be read or its header is not one of the layouts.
    """

    def __init__(
        self,
        path: Path,
        *,
        name: str | None = None,
        reading: FileReading | None = None,
        frame: Frame | None = None,
    ) -> None:
        self.path = path
        self.name = path.name if name is None else name
        self.frame = Frame() if frame is None else frame
        self._reading = FileReading() if reading is None else reading
        try:
            if path.exists() and not is_plain_file(path):  # a pipe would be waited for
                raise LogError(path, "is not a file")
            self.bytes = path.stat().st_size
            with path.open(encoding="utf-8-sig", newline="\n") as file:
                header = file.readline()
        except OSError as error:
            raise LogError(path, f"cannot be read: {error.strerror or error}") from None
        except UnicodeDecodeError:
            raise LogError(path, "is not UTF-8 text") from None
        self.bytes_read = 0
        self._refuse_separator(header)
        self._header = self._cells(header, 1)
        self._match(self._named(self._header))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(column.name for column in self.columns)

    def chunks(self) -> Iterator[tuple[Rows, int]]:
        """Give the rows (n, columns) and the line number of the first, chunk by chunk.

        Raises
        ------
        LogError
            At the first line that is not what the layout says.
        """
        for text, line in self._texts():
            yield self._converted(self._parse(text, line)), line

    def _texts(self) -> Iterator[tuple[bytes, int]]:
        """Give whole lines, about :data:`CHUNK_LINES` at once, and the number of the first."""
        line = 2
        blank = b""  # such lines at the end of the file are none, others are errors
        try:
            with self.path.open("rb") as file:
                self.bytes_read = len(file.readline())
                while chunk := file.read(CHUNK_LINES * _LINE_BYTES):
                    chunk += file.readline()
                    self.bytes_read += len(chunk)
                    text, blank = _without_blank_end(blank + chunk)
                    if text:
                        yield text, line
                        line += text.count(b"\n")
        except OSError as error:
            raise LogError(self.path, f"cannot be read: {error.strerror or error}") from None

    def whole(self) -> Rows:
        """All rows of a small file.

        Raises
        ------
        LogError
            As ``chunks``, or if the file has more than :data:`SMALL_FILE_LINES` lines.
        """
        parts = []
        for rows, line in self.chunks():
            if line - 1 + len(rows) > SMALL_FILE_LINES:
                raise LogError(self.path, f"has more than {SMALL_FILE_LINES} lines")
            parts.append(rows)
        return np.concatenate(parts) if parts else np.empty((0, len(self.columns)))

    def line_of(self, time_s: float, occurrence: int) -> int | None:
        """Line at which a time stands for the n-th time, to name it in an error."""
        for rows, first in self.chunks():
            found = np.flatnonzero(rows[:, 0] == time_s)
            if len(found) >= occurrence:
                return first + int(found[occurrence - 1])
            occurrence -= len(found)
        return None

    @property
    def geographic(self) -> bool:
        """Whether its places are given by latitude and longitude."""
        return "latitude_deg" in self._given and self.name != "origin.csv"

    def first_place(self) -> tuple[float, float] | None:
        """Give latitude and longitude (deg) of the first line; None if there is none."""
        at = self._given.index("latitude_deg")
        for text, line in self._texts():
            first = text[: text.find(b"\n") + 1] or text
            latitude, longitude = self._parse(first, line)[0, at : at + 2].tolist()
            return latitude, longitude
        return None

    def column(self, rows: Rows, name: str, default: float = math.nan) -> Rows:
        """Give a column of rows; a default where the file has not got it."""
        if name not in self.names:
            return np.full(len(rows), default)
        return rows[:, self.names.index(name)]

    def sources(self, rows: Rows) -> list[int]:
        """Give the source of each row of the whole file.

        Raises
        ------
        LogError
            If one is there twice.
        """
        sources = [int(source) for source in self.column(rows, "source").tolist()]
        for k, source in enumerate(sources):
            if source in sources[:k]:
                message = f"source {source} is there twice"
                raise LogError(self.path, message, line=k + 2, column="source")
        return sources

    def _cells(self, whole: str, line: int) -> list[str]:
        """Part a line where the separator is not between quotes."""
        text = whole.rstrip("\r\n")
        separator = self._reading.separator
        if separator == " ":
            return text.split()
        if '"' in text:
            try:
                return next(csv.reader([text], delimiter=separator), [])
            except csv.Error as error:
                why = CARRIAGE_RETURN if "\r" in text else f"is no line of cells: {error}"
                raise LogError(self.path, why, line=line) from None
        return text.split(separator)

    def _named(self, header: list[str]) -> dict[str, int]:
        """Say in which cell each column of a log stands, under its name there."""
        cells = [cell.strip() for cell in header]
        named = {cell: k for k, cell in enumerate(cells)}
        for column, said in self._reading.columns.items():
            cell = said if said in named else said.removeprefix("-")
            if cell not in named:
                raise LogError(
                    self.path,
                    f"has no column {cell!r}, which {self._reading.where} names for {column}, but "
                    f"{', '.join(cells)}",
                    line=1,
                )
            named[column] = cells.index(cell)
        return named

    def _refuse_separator(self, header: str) -> None:
        for mark, name in ((";", "semicolons"), ("\t", "tabs")):
            if mark in header and self._reading.separator not in header:
                raise LogError(
                    self.path,
                    f"cells are parted by {name}; the separator is a comma, and the decimal mark a "
                    "point, unless [columns] of the settings say otherwise",
                    line=1,
                    cause="separator",
                )

    def _match(self, cells: dict[str, int]) -> None:
        names = [cell.strip() for cell in self._header]
        found = match(self.name, cells)
        known = near(self.name, () if found is None else found.columns)
        given = set() if found is None else {*found.given, *(one.name for one in found.columns)}
        stems = {one.split("_")[0] for one in given}
        for name in names:
            stem, _, unit = name.partition("_")
            meant = [other for other in sorted(known) if other.split("_")[0] == stem]
            meant.sort(key=lambda other: "_" not in other)  # a name with a unit before one without
            wrong = found is None or (stem not in stems and unit in _OTHER_UNITS)
            if name not in known and meant and wrong and name not in self._mapped():
                raise LogError(
                    self.path, f"a log has {meant[0]}{self._conversion(name, meant[0])}", line=1,
                    column=name,
                )  # fmt: skip
        twice = found is not None and any(names.count(names[cells[one]]) > 1 for one in found.given)
        if found is None or twice:
            expected = " or ".join(str(layout) for layout in FILES[self.name])
            if self.bytes == 0:
                raise LogError(self.path, f"is empty; its first line must be {expected}")
            said = f"; {self._reading.where} names columns" if self._reading.columns else ""
            raise LogError(
                self.path,
                f"the header must be {expected}, not {','.join(names) or 'blank'}{said}",
                line=1,
            )
        self.columns = found.columns
        self._given = found.given
        self._used = [cells[one] for one in found.given]
        self._factors = [self._reading.factor(one) for one in found.given]
        self.ignored = [name for k, name in enumerate(names) if k not in self._used]
        self._plain = self._used == list(range(len(names)))
        self._limits = [COLUMNS[one] for one in self._given]

    def _conversion(self, name: str, meant: str) -> str:
        """Say which settings take a column in another unit for one of a log; "" if none do."""
        unit = unit_of(name, meant)
        stem = self.name.removesuffix(".csv")
        return unit and (
            "; auvest init LOG writes the settings that convert it "
            f'([columns.{stem}] {meant} = "{name}", [units.{stem}] {meant} = "{unit}")'
        )

    def _mapped(self) -> set[str]:
        return {said.removeprefix("-") for said in self._reading.columns.values()}

    def _parse(self, text: bytes, first: int) -> Rows:
        count = text.count(b"\n")
        if not text.endswith(b"\n"):
            message = "does not end with a line end: truncated"
            raise LogError(self.path, message, line=first + count)
        rows = self._numbers(text, count)
        if rows is None:
            try:
                lines = [f"{line}\n" for line in text[:-1].decode().split("\n")]
            except UnicodeDecodeError:
                raise LogError(self.path, f"is not UTF-8 text after line {first - 1}") from None
            rows = self._loaded(lines)
            if rows is None:
                rows = np.array([self._parse_line(one, first + i) for i, one in enumerate(lines)])
        for k, factor in enumerate(self._factors):
            if factor != 1.0:
                rows[:, k] *= factor
        self._check(rows, first)
        return rows

    def _numbers(self, text: bytes, count: int) -> Rows | None:
        """Read lines of plain numbers fast; None if there is anything else among them."""
        said = self._reading
        if said.decimal != "." or said.separator == " " or "time" in self._given:
            return None
        if count < FEW_LINES or not text.isascii():
            return None
        from pyarrow import ArrowInvalid, BufferReader, csv, float64  # here: slow to import

        names = [str(k) for k in range(len(self._header))]
        used = [names[k] for k in self._used]
        with suppress(ArrowInvalid):  # the other ways to read say what is wrong, and where
            table = csv.read_csv(
                BufferReader(text),
                csv.ReadOptions(use_threads=False, column_names=names, block_size=len(text)),
                csv.ParseOptions(
                    delimiter=said.separator, quote_char=False, ignore_empty_lines=False
                ),
                csv.ConvertOptions(
                    include_columns=used, column_types=dict.fromkeys(used, float64()),
                    null_values=[],
                ),
            )  # fmt: skip
            if len(table) == count:  # a carriage return ends a line there, and none here
                # Not to_numpy, which imports pandas.
                (batch,) = table.to_batches()
                columns = (one.buffers()[1] for one in batch.columns)
                rows = np.column_stack([np.frombuffer(one, np.float64) for one in columns])
                return None if np.isnan(rows).any() else rows  # it has more spellings there
        return None

    def _loaded(self, lines: list[str]) -> Rows | None:
        """Read lines at once; None if one of them is not what it should be."""
        separator, iso = self._reading.separator, "time" in self._given
        if separator != " " and (not self._plain or iso):
            count = len(self._header) - 1
            if any(line.count(separator) != count for line in lines):
                return None
        if self._reading.decimal == ",":
            lines = [line.replace(",", ".") for line in lines]
        options: dict[str, Any] = {} if self._plain else {"usecols": self._used}
        if iso:
            options["converters"] = {self._used[self._given.index("time")]: seconds_of}
        with suppress(ValueError):
            delimiter = None if separator == " " else separator
            rows = np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2, **options)
            if rows.shape == (len(lines), len(self._used)):
                return rows
        return None

    def _parse_line(self, text: str, line: int) -> list[float]:
        cells = self._cells(text, line)
        expected = len(self._header)
        if len(cells) != expected:
            comma = len(cells) > expected and all(map(_digits, cells))
            cause = "decimal_comma" if comma else "unreadable"
            message = other_cells(len(cells), expected)
            raise LogError(self.path, message, line=line, cause=cause)
        values = []
        for k, given in zip(self._used, self._given, strict=True):
            cell = cells[k]
            try:
                if given == "time":
                    values.append(seconds_of(cell))
                    continue
                if self._reading.decimal == ",":
                    cell = cell.replace(",", ".")
                values.append(float(cell.replace("_", "?")))  # 1_000 is Python's, not a number
            except ValueError as error:
                what = f"{cell.strip()!r} is not a number" if cell.strip() else "is empty"
                if given == "time" and cell.strip():
                    what = str(error)
                elif given == "source" and cell.strip():
                    what += "; sources have numbers, the same in every file"
                name = self._header[k].strip()
                raise LogError(self.path, what, line=line, column=name) from None
        return values

    def _converted(self, rows: Rows) -> Rows:
        """Give rows with the numbers that the layout's names stand for, on the log's axes."""
        given, frame = self._given, self.frame
        for k, name in enumerate(given):
            if name in ("left_m", "left_m_s"):
                rows[:, k] = frame.sideways(rows[:, k])
            elif name in ("starboard_m", "starboard_m_s"):
                rows[:, k] = -frame.sideways(rows[:, k])
            elif name in ("compass_rad", "azimuth_rad"):
                rows[:, k] = frame.from_north(rows[:, k])
            elif name == "depression_rad":
                rows[:, k] = -rows[:, k]
        if self.geographic:
            k = given.index("latitude_deg")
            rows[:, k], rows[:, k + 1] = frame.local(rows[:, k].copy(), rows[:, k + 1].copy())
        return rows

    def _check(self, rows: Rows, first: int) -> None:
        for k, column in enumerate(self._limits):
            values = rows[:, k]
            good = column.takes(values)
            if good.all():
                continue
            i = int(np.argmin(good))
            value = float(values[i])
            suspicion, cause = column.suspect(value)
            hint = f" ({suspicion})" if suspicion else ""
            missing = "; leave out the row where there is no measurement" if value != value else ""
            given, unit = "", self._reading.units.get(self._given[k], "")
            if unit:
                missing += f"; {self._reading.units_where} says {unit!r}"
                given = f"{value / self._factors[k]:.10g} {unit}"
                if unit != column.unit:
                    given += f" = {value:.10g} {column.unit}"
            raise LogError(
                self.path,
                f"{column.breach(value, given)}{hint}{missing}",
                line=first + i,
                column=self._header[self._used[k]].strip(),
                cause=cause,
            )


def _without_blank_end(text: bytes) -> tuple[bytes, bytes]:
    """Part lines where nothing but blank ones follow."""
    last = len(text.rstrip())
    end = text.find(b"\n", last) + 1 or len(text)
    return (text[:end], text[end:]) if last else (b"", text)


def _digits(cell: str) -> bool:
    """Whether a cell is what a decimal comma leaves of a number."""
    bare = cell.strip().strip('"').lstrip("+-")
    return bare.isdecimal() and bare.isascii()


def not_a_folder(path: Path) -> str:
    """Say why a path is not that of a log's folder."""
    if path.exists():
        return "is a file; a log is a folder of CSV files (auvest check --layout)"
    return "there is no such folder"


class LogFolder:
    """A log: the files of :data:`auvest.logs.FILES` that its folder has.

    Parameters
    ----------
    path : Path
        The folder.
    truth : bool
        False: truth.csv is left out where the run does not start from it.
    reading : Reading, optional
        Which way the axes point, and how files are read that are not as docs/logs.md says.

    Attributes
    ----------
    frame : Frame
        The axes, and where they begin on Earth.

    Raises
    ------
    LogError
        If it is not a folder with measurements: odometry.csv with ranges.csv, fixes.csv or
        positions.csv, or one of the last two alone; beside ranges and fixes beacons.csv,
        leaders.csv or both; or odometry.csv with echoes.csv, and none of these.
    """

    def __init__(self, path: Path, *, truth: bool = True, reading: Reading | None = None) -> None:
        self.path = path
        if not path.is_dir():
            raise LogError(path, not_a_folder(path))
        reading = Reading() if reading is None else reading
        paths = {name: path / (reading.of(name).file or name) for name in FILES}
        for name, one in paths.items():
            if reading.of(name).file and not one.exists():
                raise LogError(one, f"is not there, and {reading.of(name).where} names it")
        names = [name for name, one in paths.items() if one.exists()]
        if not truth and ("start.csv" in names or "odometry.csv" not in names):
            names = [name for name in names if name not in TRUTHS]
        self.frame = Frame(reading.frame)
        self.tables = {
            name: CsvTable(paths[name], name=name, reading=reading.of(name), frame=self.frame)
            for name in names
        }
        self._require_what_a_log_needs()
        self._find_origin()

    def _require_what_a_log_needs(self) -> None:
        path = self.path
        if "echoes.csv" in self:
            self._require_what_echoes_need()
            return
        measured = [name for name in ("ranges.csv", "fixes.csv", "positions.csv") if name in self]
        if not measured:
            raise LogError(
                path, "has neither ranges.csv nor fixes.csv nor positions.csv nor echoes.csv"
            )
        if "odometry.csv" not in self:
            if "ranges.csv" in self:
                raise LogError(path, "has ranges.csv but no odometry.csv", cause="no_odometry")
            if "compass.csv" in self:
                raise LogError(path, "has compass.csv but no odometry.csv", cause="no_odometry")
        elif "velocities.csv" in self:
            raise LogError(
                path, "has odometry.csv and velocities.csv; the second is for a craft that is "
                "tracked, without the first",
            )  # fmt: skip
        placed = "beacons.csv" in self or "leaders.csv" in self
        if measured != ["positions.csv"] and not placed:
            raise LogError(path, "has neither beacons.csv nor leaders.csv: where are the sources?")
        if "odometry.csv" in self and "compass.csv" not in self:
            table = self["odometry.csv"]
            if not {"turn_rad", "yaw_rate_rad_s", "heading_rad"} & set(table.names):
                raise LogError(
                    table.path, "has no turn_rad, yaw_rate_rad_s or heading_rad, and there is no "
                    "compass.csv: how does the craft turn?", line=1,
                )  # fmt: skip

    def _require_what_echoes_need(self) -> None:
        others = {*NOT_WITH_ECHOES} & set(self.tables)
        if others:
            raise LogError(
                self.path, f"has echoes.csv and {min(others)}; filters that hear the echoes of "
                "masters take nothing else that is measured",
            )  # fmt: skip
        if "odometry.csv" not in self:
            raise LogError(self.path, "has echoes.csv but no odometry.csv", cause="no_odometry")
        table = self["odometry.csv"]
        names = set(table.names)
        if names & {"left_m", "left_m_s"}:
            raise LogError(
                table.path,
                "says how the craft moves sideways, which filters of echoes do not know",
                line=1,
            )  # fmt: skip
        turns = names & {"turn_rad", "yaw_rate_rad_s"}
        if not turns and not {"speed_m_s", "heading_rad"} <= names:
            raise LogError(
                table.path,
                "has no turn_rad or yaw_rate_rad_s, nor speed_m_s with heading_rad: how does the "
                "slave turn?",
                line=1,
            )

    def _find_origin(self) -> None:
        """Find where on Earth (0, 0) is, if a file has places there."""
        names = (
            "start.csv", "beacons.csv", "leaders.csv", "positions.csv", "masters.csv", "truth.csv",
            "master_truth.csv",
        )  # fmt: skip
        geographic = [name for name in names if name in self and self[name].geographic]
        local = [name for name in names if name in self and not self[name].geographic]
        if "origin.csv" in self:
            table = self["origin.csv"]
            rows = table.whole()
            if len(rows) != 1:
                raise LogError(table.path, f"has {len(rows)} lines below the header, expected 1")
            self.frame.origin = (float(rows[0, 0]), float(rows[0, 1]))
        elif geographic and local:
            raise LogError(
                self.path,
                f"{geographic[0]} has latitudes and {local[0]} metres: where on Earth is (0, 0)? "
                "Say so in origin.csv",
            )
        for name in geographic:
            if self.frame.origin is None:
                self.frame.origin = self[name].first_place()

    def __contains__(self, name: object) -> bool:
        return name in self.tables

    def __getitem__(self, name: str) -> CsvTable:
        return self.tables[name]

    @property
    def echoing(self) -> bool:
        """True if a slave hears the echoes of masters."""
        return "echoes.csv" in self

    @property
    def tracking(self) -> bool:
        """True if a craft is tracked that tells no odometry, False if it tells its own."""
        return "odometry.csv" not in self

    def beacons(self) -> dict[int, tuple[float, float]]:
        """Give the positions (m) of the sources that do not move."""
        return {source: place[:2] for source, place in self.stations().items()}

    def stations(self) -> dict[int, tuple[float, float, float]]:
        """Give positions and depths (m) of the sources that do not move; at 0 m where unsaid."""
        if "beacons.csv" not in self:
            return {}
        table = self["beacons.csv"]
        rows = table.whole()
        depths = table.column(rows, "depth_m", 0.0)
        places = zip(rows[:, 1].tolist(), rows[:, 2].tolist(), depths.tolist(), strict=True)
        return dict(zip(table.sources(rows), places, strict=True))
