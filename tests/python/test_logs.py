"""Logs: what the reader takes and refuses, the order of time, importers."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from auvest.importers.sets import IMPORTERS
from auvest.logs import FILES, Column, CsvTable, LogError, LogFolder, Stream, merge, reader
from auvest.logs.write import write_file


def write(folder: Path, name: str, text: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text, encoding="utf-8", newline="")
    return path


def read(path: Path) -> np.ndarray:
    return CsvTable(path).whole()


def test_reads_what_was_written_to_the_last_bit(tmp_path: Path) -> None:
    time = 1665936896.123456 + 0.1 * np.arange(5)
    spread = np.array([0.1, 1 / 3, 1e-9, 12345.678901234567, math.pi])
    write_file(tmp_path, "ranges.csv", time_s=time, source=[0, 1, 2, 3, 4], range_m=spread)
    rows = read(tmp_path / "ranges.csv")
    np.testing.assert_array_equal(rows, np.column_stack([time, np.arange(5), spread]))


def test_columns_may_come_in_any_order_and_lines_may_end_as_in_windows(tmp_path: Path) -> None:
    path = write(tmp_path, "ranges.csv", "\ufeffrange_m,time_s,source\r\n5.5,1,7\r\n6.5,2,8\r\n")
    np.testing.assert_array_equal(read(path), [[1, 7, 5.5], [2, 8, 6.5]])


HEAD = "time_s,source,range_m\n"


@pytest.mark.parametrize(
    ("text", "line", "column", "words"),
    [
        # truncated
        (HEAD + "1,0,5\n2,0,", 3, None, "truncated"),
        (HEAD + "1,0,5\n2,0\n", 3, None, ": 2 cells, expected 3: truncated?"),
        (HEAD + "1,0,5\n2,0,6", 3, None, "line end"),
        (HEAD + "1,0,5\n\n2,0,6\n", 3, None, ": 1 cell, expected 3: truncated?"),
        (HEAD + "\n1,0,5\n", 2, None, ": 1 cell, expected 3: truncated?"),
        (
            HEAD + "1,0,5,9\n",
            2,
            None,
            "4 cells, expected 3: a comma within a cell, or decimal commas?",
        ),
        (
            HEAD + "1,0,5,x\n",
            2,
            None,
            "4 cells, expected 3: a comma within a cell, or decimal commas?",
        ),
        # NaN-ridden
        (HEAD + "1,0,nan\n", 2, "range_m", "leave out the row"),
        (HEAD + "1,0,5\nnan,0,5\n", 3, "time_s", "nan is not a number from"),
        (HEAD + "1,0,inf\n", 2, "range_m", "inf is not a number from"),
        (HEAD + "1,0,\n", 2, "range_m", "is empty"),
        (HEAD + "1,0,1_0\n", 2, "range_m", "'1_0' is not a number"),
        (HEAD + "1,0,five\n", 2, "range_m", "'five' is not a number"),
        # wrong units
        (
            HEAD + "1,0,5\n1665936896000,0,5\n",
            3,
            "time_s",
            "1.665936896e+12 lies outside -1e+11..1e+11 s (milliseconds?)",
        ),
        (
            HEAD + "1665936896000000,0,5\n",
            2,
            "time_s",
            "1.665936896e+15 lies outside -1e+11..1e+11 s (microseconds?)",
        ),
        (
            HEAD + "1665936896000000000,0,5\n",
            2,
            "time_s",
            "1.665936896e+18 lies outside -1e+11..1e+11 s (nanoseconds?)",
        ),
        (HEAD + "-1e12,0,5\n", 2, "time_s", "column time_s: -1e+12 lies outside -1e+11..1e+11 s"),
        (HEAD + "1,0,-1\n", 2, "range_m", "no echo"),
        (
            HEAD + "1,0,250000\n",
            2,
            "range_m",
            "250000 lies outside 0..100000 m (millimetres, or a code for 'no echo'?)",
        ),
        (HEAD + "1,0.5,5\n", 2, "source", "0.5 is not an integer from 0 to 1000000000"),
        ("time_ms,source,range_m\n", 1, "time_ms", "a log has time_s; auvest init"),
        ("time_s,source,range_km\n", 1, "range_km", "a log has range_m; auvest init"),
        # not a log at all
        ("", None, None, "ranges.csv: is empty; its first line must be time_s,source,range_m"),
        ("\n", 1, None, "the header must be time_s,source,range_m, not blank"),
        ("1,2,3\n", 1, None, "the header must be"),
        ("time_s,source,range_m,range_m\n", 1, None, "the header must be"),
        (
            HEAD + '1,0,5\n1,"0"\r,5\n',
            3,
            None,
            "line 3: has a carriage return within it: lines must end with LF or CRLF",
        ),
        (
            '"time_s"\r,source,range_m\n',
            1,
            None,
            "line 1: has a carriage return within it: lines must end with LF or CRLF",
        ),
    ],
)
def test_refuses_with_file_line_and_column(
    tmp_path: Path, text: str, line: int | None, column: str | None, words: str
) -> None:
    path = write(tmp_path, "ranges.csv", text)
    with pytest.raises(LogError) as caught:
        read(path)
    assert (caught.value.path, caught.value.line, caught.value.column) == (path, line, column)
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"{path}: " if line is None else f"{path}, line {line}")


@pytest.mark.parametrize(
    ("name", "text", "column", "suspicion"),
    [
        ("fixes.csv", "time_s,source,range_m,bearing_rad\n1,0,5,90\n", "bearing_rad", "degrees"),
        ("odometry.csv", "time_s,forward_m,left_m,turn_rad\n1,0,0,45\n", "turn_rad", "degrees"),
        ("odometry.csv", "time_s,speed_m_s,yaw_rate_rad_s\n1,1500,0\n", "speed_m_s", "milli"),
        (
            "truth.csv",
            "time_s,x_m,y_m,heading_rad\n1,0,0,180\n",
            "heading_rad",
            "180 lies outside -6.283285307..6.283285307 rad (degrees?)",
        ),
        (
            "water.csv",
            "time_s,temperature_c\n1,283\n",
            "temperature_c",
            "283 lies outside -5..60 (kelvin?)",
        ),
        (
            "water.csv",
            "time_s,temperature_c\n1,-999\n",
            "temperature_c",
            "-999 lies outside -5..60 (a code for 'no value'?)",
        ),
    ],
)
def test_suspects_the_unit(
    tmp_path: Path, name: str, text: str, column: str, suspicion: str
) -> None:
    path = write(tmp_path, name, text)
    with pytest.raises(LogError, match=re.escape(suspicion)) as caught:
        read(path)
    assert caught.value.column == column


def test_a_full_turn_that_was_rounded_is_read(tmp_path: Path) -> None:
    """6.28319 is 2 pi to five decimals, 6.2832 to four."""
    text = "time_s,heading_rad\n0,6.28319\n1,-6.2832\n"
    rows = read(write(tmp_path, "compass.csv", text))
    np.testing.assert_array_equal(rows[:, 1], [6.28319, -6.2832])


@pytest.mark.parametrize("lines", [1, 2, 1000])
@pytest.mark.parametrize("end", ["\n", "\n\n \n", "\r\n\t\n", "  "])
def test_blank_lines_at_the_end_are_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int, end: str
) -> None:
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    path = write(tmp_path, "ranges.csv", HEAD + "1,0,5\n2,0,6\n" + end)
    np.testing.assert_array_equal(read(path), [[1, 0, 5], [2, 0, 6]])
    assert len(read(write(tmp_path, "ranges.csv", HEAD + end))) == 0


@pytest.mark.parametrize("lines", [1, 2, 1000])
def test_blank_lines_that_others_follow_are_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int
) -> None:
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    path = write(tmp_path, "ranges.csv", HEAD + "1,0,5\n\n\n2,0,6\n")
    with pytest.raises(LogError) as caught:
        read(path)
    assert caught.value.line == 3


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("depth.csv", "time_s,depth_m"),
        ("truth.csv", "time_s,x_m,y_m[,heading_rad]"),
        ("positions.csv", "time_s,x_m,y_m[,sigma_m,depth_m]"),
        ("start.csv", "time_s,x_m,y_m,heading_rad or time_s,x_m,y_m"),
    ],
)
def test_a_header_that_is_wrong_is_told_what_it_must_be(
    tmp_path: Path, name: str, expected: str
) -> None:
    """What may be left out is in brackets, of which there are none where nothing may."""
    (tmp_path / name).write_text("a,b\n1,2\n")
    with pytest.raises(LogError) as caught:
        CsvTable(tmp_path / name)
    assert str(caught.value).endswith(f"line 1: the header must be {expected}, not a,b")


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("time_s;source;range_m\n1;0;5\n", "separator"),
        ("time_s\tsource\trange_m\n1\t0\t5\n", "separator"),
        (HEAD + "1,5,0,7,25\n", "decimal_comma"),
        (HEAD + "1,0\n", "unreadable"),
        (HEAD + "1,0,nan\n", "unreadable"),
        (HEAD + "1665936896000,0,5\n", "milliseconds"),
        (HEAD + "1665936896000000,0,5\n", "microseconds"),
        (HEAD + "1,0,-1\n", "no_echo"),
        (HEAD + "1,0,250000\n", "millimetres"),
    ],
)
def test_an_error_names_its_cause(tmp_path: Path, text: str, cause: str) -> None:
    with pytest.raises(LogError) as caught:
        read(write(tmp_path, "ranges.csv", text))
    assert caught.value.cause == cause


#: Lines that are no "k,0,5.5", and how a slow reader takes them; all else is refused.
_ODD = (
    "7,0", "7,0,", "7,,5", "7,0,5,", "7,0,5,6", "7,0,1_0", "7,0,0x10", "7,0,5d0", '7,0,"5"',
    "7,0,1e999",
    "7,0,nan", "7,0,nan(a)", "7,0,inf", "7,0,NULL", "7,0,true", "7,0, ", "7,0,5\r", "7,0,5\r7,0,5",
    "7,0,\r5", "7,0,5\x00", "7,0,\u0665", "7,0,5\xa0", "", " ", "7;0;5", "7,0,5#", "7.5,0.5,5",
    "7,0,-5",
    " 7 ,0,\t5", "+7,0,+5.", "7,0,.5e1", "7,0,1e-400", "007,0,0005",
    "7,0,4.9406564584124654e-324", "7,0,0.1000000000000000055511151231257827021181583404541015625",
)  # fmt: skip


@pytest.mark.parametrize("odd", _ODD, ids=ascii)
def test_fast_reading_takes_and_refuses_what_slow_reading_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, odd: str
) -> None:
    lines = [f"{k},{k % 3},5.{k}" for k in range(40)]
    lines[17] = odd
    path = write(tmp_path, "ranges.csv", HEAD + "\n".join(lines) + "\n")

    def found(few: int) -> bytes | tuple[str, str]:
        monkeypatch.setattr(reader, "FEW_LINES", few)
        try:
            return read(path).tobytes()
        except LogError as error:
            return str(error), error.cause

    fast = found(1)
    assert fast == found(1000)
    if isinstance(fast, tuple):
        assert "line 19" in fast[0] or "after line 1" in fast[0]


def test_numbers_are_read_to_the_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As Python writes and reads them."""
    monkeypatch.setattr(reader, "FEW_LINES", 1)
    rng = np.random.default_rng(1)
    numbers = 10.0 ** rng.uniform(-300, 4.9, 4000) * rng.uniform(0.1, 1, 4000)
    rows = [f"{k},0,{number!r}" for k, number in enumerate(numbers.tolist())]
    path = write(tmp_path, "ranges.csv", HEAD + "\n".join(rows) + "\n")
    np.testing.assert_array_equal(read(path)[:, 2], numbers)


def test_line_numbers_are_those_of_the_file_in_later_chunks_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reader, "CHUNK_LINES", 4)
    lines = [f"{k},0,5" for k in range(10)]
    lines[8] = "8,0,-5"
    path = write(tmp_path, "ranges.csv", HEAD + "\n".join(lines) + "\n")
    with pytest.raises(LogError) as caught:
        read(path)
    assert caught.value.line == 10  # the header is line 1


@pytest.mark.parametrize("lines", [2, 100])
def test_a_file_that_is_read_as_a_whole_must_be_small(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int
) -> None:
    monkeypatch.setattr(reader, "SMALL_FILE_LINES", 10)
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    path = write(tmp_path, "ranges.csv", HEAD + "1,0,5\n" * 9)
    assert len(read(path)) == 9
    path = write(tmp_path, "ranges.csv", HEAD + "1,0,5\n" * 10)
    with pytest.raises(LogError, match=r"ranges\.csv: has more than 10 lines"):
        read(path)


ALL_COLUMNS = sorted(
    {
        (name, column)
        for name, layouts in FILES.items()
        for layout in layouts
        for column in layout.columns
    },
    key=lambda pair: (pair[0], pair[1].name),
)


@pytest.mark.parametrize(
    ("name", "column"), ALL_COLUMNS, ids=[f"{name}-{column.name}" for name, column in ALL_COLUMNS]
)
def test_the_limits_of_a_column_are_read_and_nothing_beyond(
    tmp_path: Path, name: str, column: Column
) -> None:
    layout = next(one.columns for one in FILES[name] if column in one.columns)
    header = ",".join(other.name for other in layout)

    def table(value: float) -> Path:
        cells = (repr(value) if other is column else "0" for other in layout)
        return write(tmp_path, name, f"{header}\n{','.join(cells)}\n")

    at = layout.index(column)
    for limit, beyond in ((column.low, -math.inf), (column.high, math.inf)):
        assert read(table(float(limit)))[0, at] == limit
        step = math.copysign(1.0, beyond)
        next_one = limit + step if column.integer else math.nextafter(limit, beyond)
        with pytest.raises(LogError, match=re.escape(f" lies outside {column.span}")) as caught:
            read(table(next_one))
        assert (caught.value.line, caught.value.column) == (2, column.name)


def test_not_text_and_not_there(tmp_path: Path) -> None:
    path = tmp_path / "ranges.csv"
    with pytest.raises(LogError, match="cannot be read"):
        CsvTable(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(LogError, match="not UTF-8"):
        CsvTable(path)
    path.write_bytes(HEAD.encode() + b"1,0,\xff\n")
    with pytest.raises(LogError, match="not UTF-8"):
        read(path)


def stream(folder: Path, times: list[float], *, reorder_s: float, required: bool = False) -> Stream:
    text = HEAD + "".join(f"{time},{k},1\n" for k, time in enumerate(times))
    return Stream(
        CsvTable(write(folder, "ranges.csv", text)), reorder_s=reorder_s, required=required
    )


def merged(*streams: Stream) -> list[np.ndarray]:
    """All rows of each stream, and a check that they come in the order of time and complete."""
    parts: list[list[np.ndarray]] = [[] for _ in streams]
    before = -math.inf
    for chunk, horizon in merge({str(k): s for k, s in enumerate(streams)}):
        for k, rows in enumerate(chunk.values()):
            assert (rows[:, 0] >= before).all()
            assert (rows[:, 0] < horizon).all()
            parts[k].append(rows)
        before = horizon
    return [np.concatenate(part) for part in parts]


@pytest.mark.parametrize("lines", [1, 2, 3, 100])
def test_late_lines_are_put_in_order_within_the_window_and_counted_beyond(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int
) -> None:
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    #        line    2  3  4    5  6  7    8
    one = stream(tmp_path, [0, 3, 1.5, 4, 1, 3.5, 2], reorder_s=2.0)
    (rows,) = merged(one)
    np.testing.assert_array_equal(rows[:, 0], [0, 1.5, 2, 3, 3.5, 4])
    np.testing.assert_array_equal(rows[:, 1], [0, 2, 6, 1, 5, 3])
    assert (one.late.reordered, one.late.dropped, one.late.lines) == (3, 1, [6])


def test_a_shuffled_file_is_an_error_where_order_matters(tmp_path: Path) -> None:
    shuffled = stream(tmp_path, [0, 5, 4, 6], reorder_s=0.5, required=True)
    with pytest.raises(LogError, match=r"line 4.*1 s older.*window.*0\.5 s: shuffled"):
        merged(shuffled)


def test_lines_of_one_time_keep_the_order_of_the_file(tmp_path: Path) -> None:
    """Many of them, late ones too: sources 0 to 99 at 4 s, recorded after a line of 5 s."""
    one = stream(tmp_path, [0, 5] + [4] * 100 + [5, 5], reorder_s=2.0)
    (rows,) = merged(one)
    assert rows[:, 0].tolist() == [0] + [4] * 100 + [5] * 3
    assert rows[:, 1].tolist() == [0, *range(2, 102), 1, 102, 103]
    assert (one.late.reordered, one.late.dropped) == (100, 0)


def test_the_window_for_late_lines_is_as_long_as_it_says(tmp_path: Path) -> None:
    one = stream(tmp_path, [0, 10, 8, 7.999], reorder_s=2.0)
    (rows,) = merged(one)
    assert rows[:, 0].tolist() == [0, 8, 10]
    assert (one.late.reordered, one.late.dropped, one.late.lines) == (1, 1, [5])


@pytest.mark.parametrize("lines", [2, 3, 100])
def test_the_first_lines_that_came_too_late_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int
) -> None:
    """Every other of 18 lines, from line 3 on: nine are dropped, five are named."""
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    one = stream(tmp_path, [t for k in range(9) for t in (10 + k, k)], reorder_s=0.0)
    (rows,) = merged(one)
    assert rows[:, 0].tolist() == list(range(10, 19))
    assert (one.late.dropped, one.late.lines) == (9, [3, 5, 7, 9, 11])


@pytest.mark.parametrize("lines", [1, 7, 1000])
def test_files_of_different_rate_come_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int
) -> None:
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    fast = stream(tmp_path / "fast", [0.1 * k for k in range(200)], reorder_s=0.0)
    slow = stream(tmp_path / "slow", [0.0, 9.0, 9.0, 19.0, 50.0], reorder_s=0.0)
    empty = stream(tmp_path / "empty", [], reorder_s=0.0)
    rows = merged(fast, slow, empty)
    assert [len(part) for part in rows] == [200, 5, 0]


LAYOUT = {
    "odometry.csv": "time_s,speed_m_s,yaw_rate_rad_s\n0,1,0\n",
    "ranges.csv": HEAD + "1,0,5\n",
    "fixes.csv": "time_s,source,range_m,bearing_rad\n1,0,5,0\n",
    "beacons.csv": "source,x_m,y_m\n0,0,0\n",
    "compass.csv": "time_s,heading_rad\n0,0\n",
    "velocities.csv": "time_s,forward_m_s,left_m_s,heading_rad\n0,0,0,0\n",
}


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ("odometry beacons", "neither ranges.csv nor fixes.csv nor positions.csv"),
        ("ranges beacons", "no odometry.csv"),
        ("odometry ranges", "where are the sources"),
        ("ranges fixes beacons", "has ranges.csv but no odometry.csv"),
        ("fixes compass beacons", "has compass.csv but no odometry.csv"),
        ("odometry ranges beacons velocities", "has odometry.csv and velocities.csv"),
    ],
)
def test_a_folder_must_have_what_a_log_needs(tmp_path: Path, files: str, words: str) -> None:
    for name in files.split():
        write(tmp_path, f"{name}.csv", LAYOUT[f"{name}.csv"])
    with pytest.raises(LogError, match=words):
        LogFolder(tmp_path)


def test_a_file_is_not_a_folder(tmp_path: Path) -> None:
    path = write(tmp_path, "ranges.csv", HEAD)
    with pytest.raises(LogError, match=r"ranges\.csv: is a file; a log is a folder of CSV files"):
        LogFolder(path)


def test_a_beacon_stands_in_one_place(tmp_path: Path) -> None:
    for name in ("odometry.csv", "ranges.csv"):
        write(tmp_path, name, LAYOUT[name])
    write(tmp_path, "beacons.csv", "source,x_m,y_m\n3,1,2\n4,3,4\n3,1,2\n")
    with pytest.raises(LogError, match="source 3 is there twice") as caught:
        LogFolder(tmp_path).beacons()
    assert caught.value.line == 4


def test_writing_refuses_columns_of_no_layout(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="must have the columns"):
        write_file(tmp_path, "ranges.csv", time_s=[0.0], range_m=[1.0])


def utias(folder: Path) -> Path:
    """Five robots in the original text format; robots 1 and 2 see each other, and a landmark."""
    write(folder, "Barcodes.dat", "# Subject# Barcode#\n1 5\n2 14\n3 41\n4 32\n5 23\n6 72\n")
    for robot in range(1, 6):
        write(
            folder,
            f"Robot{robot}_Groundtruth.dat",
            f"# Time x y orientation\n1000.5 {robot}.0 0.0 0.5\n1001.5 {robot}.5 1.0 0.6\n",
        )
        write(folder, f"Robot{robot}_Odometry.dat", "# Time v w\n1000.6  0.1\t0.01\n")
        write(folder, f"Robot{robot}_Measurement.dat", f"# Time code r b\n1000.9 72 9 0.{robot}\n")
    seen = "# Time code r b\n1000.7 14 1.25 0.1\n1000.8 99 7.0 0.1\n"
    write(folder, "Robot1_Measurement.dat", seen)
    write(folder, "Robot2_Measurement.dat", "1000.65 5 1.5 0.2\n")
    return folder


def test_utias_text_files(tmp_path: Path) -> None:
    folders = IMPORTERS["mrclam"](utias(tmp_path / "set"), tmp_path / "logs")
    assert [folder.name for folder in folders] == [f"robot{k}" for k in range(1, 6)]
    first = LogFolder(folders[0])
    # Both directions are ranges of robot 1 to robot 2; barcode 99 is nobody's, 72 a landmark's.
    np.testing.assert_allclose(
        first["ranges.csv"].whole(), [[0.65, 2, 1.5], [0.7, 2, 1.25]], rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(first["odometry.csv"].whole(), [[0.6, 0.1, 0.01]], atol=1e-9)
    leaders = first["leaders.csv"].whole()
    assert sorted(set(leaders[:, 1])) == [2, 3, 4, 5]
    np.testing.assert_allclose(
        first["truth.csv"].whole(), [[0.5, 1, 0, 0.5], [1.5, 1.5, 1, 0.6]], atol=1e-9
    )
    assert len(LogFolder(folders[4])["ranges.csv"].whole()) == 0


@pytest.mark.parametrize("name", sorted(IMPORTERS))
def test_importers_name_the_file_that_is_missing(tmp_path: Path, name: str) -> None:
    with pytest.raises(LogError, match=f"{tmp_path}.*cannot be read"):
        IMPORTERS[name](tmp_path, tmp_path / "out")


def test_importers_refuse_another_table(tmp_path: Path) -> None:
    write(tmp_path, "odometry.csv", "a,b\n1,2\n")
    with pytest.raises(LogError, match="has no column t: is this the set named"):
        IMPORTERS["goats14"](tmp_path, tmp_path / "out")
    (tmp_path / "odometry.csv").write_text("t,dx_body,dy_body,dtheta\n1,2,x,4\n")
    with pytest.raises(LogError, match="line 2: 'x' is not a number"):
        IMPORTERS["goats14"](tmp_path, tmp_path / "out")
