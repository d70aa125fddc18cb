"""`auvest fit`: which filters fit a chip, by the figures that come with the package."""

import csv
import json

import pytest
from typer.testing import CliRunner

from auvest import _headers
from auvest.cli import app
from auvest.firmware import fit


def run(*arguments):
    return CliRunner().invoke(app, ["fit", *map(str, arguments)])


@pytest.fixture(scope="module")
def committed(root):
    with (root / "firmware/budgets.csv").open() as file:
        return {(row["target"], row["program"]): row for row in csv.DictReader(file)}


def test_what_is_left_is_what_the_filter_does_not_take(committed):
    row = committed["cortex-m3", "robust_ekf_update"]
    (found,) = [
        one for one in fit.fit(20_480, 65_536, 500, ["cortex-m3"]) if one.filter == "robust-ekf"
    ]
    assert found.flash_left_bytes == 65_536 - int(row["flash_bytes"])
    taken = int(row["static_ram_bytes"]) + int(row["stack_bytes"])
    assert found.ram_left_bytes == 20_480 - taken - 500
    assert found.fits


@pytest.mark.parametrize("short", ["ram", "flash"])
def test_the_last_byte_counts(short):
    (ekf,) = [one for one in fit.fit(8_192, 65_536, 0, ["cortex-m0"]) if one.filter == "ekf"]
    exact = {"ram": ekf.static_ram_bytes + ekf.stack_bytes + 100, "flash": ekf.flash_bytes}

    def fits(**given):
        rows = fit.fit(**given, stack=100, chips=["cortex-m0"])
        return {one.filter: one.fits for one in rows}["ekf"]

    assert fits(**exact)
    assert not fits(**{**exact, short: exact[short] - 1})


def test_an_uno_takes_the_small_filters_and_no_particles():
    rows = fit.fit(2_048, 32_256, chips=["atmega328p"])
    names = {row.filter for row in rows if row.fits}
    assert {"ekf", "aukf", "robust-ekf"} <= names
    assert not {name for name in names if name.startswith("slatf")}
    # All that was measured there fits; with a reserve for the stack less does.
    assert names == {row.filter for row in rows}
    spared = {row.filter for row in fit.fit(2_048, 32_256, 1_300, ["atmega328p"]) if row.fits}
    assert spared < names


def test_more_memory_takes_no_filter_away():
    small = {(row.chip, row.filter) for row in fit.fit(4_096, 32_768) if row.fits}
    large = {(row.chip, row.filter) for row in fit.fit(16_384, 65_536) if row.fits}
    assert small < large


def test_the_command_prints_a_column_for_each_chip_or_the_bytes_of_one():
    done = run("--ram", 2048, "--flash", 32256)
    assert done.exit_code == 0, done.output
    lines = [line.split() for line in done.stdout.splitlines()]
    assert lines[0] == ["filter", *fit.SHORT.values()]
    marks = {name: dict(zip(fit.CHIPS, cells, strict=True)) for name, *cells in lines[1:]}
    assert list(marks) == list(fit.FILTERS)
    assert marks["ekf"]["atmega328p"] == "yes"
    assert marks["slatf2"]["atmega328p"] == "-"
    assert marks["slatf2"]["cortex-m4f"] == "no"
    one = run("--ram", 2048, "--flash", 32256, "--chip", "cortex-m4f").stdout
    assert fit.CHIPS["cortex-m4f"] in one
    assert "flash left" in one
    assert fit.FILTERS["unknown-start"] in one
    assert all(len(line) <= 80 for line in (done.stdout + one).splitlines())


def test_json_has_every_row_and_what_was_asked():
    done = run("--ram", 8192, "--flash", 253952, "--stack", 500, "--json", "--chip", "atmega2560")
    found = json.loads(done.stdout)
    assert found["stack_reserve_bytes"] == 500
    assert [row["filter"] for row in found["filters"]] == list(fit.FILTERS)
    shared = {row["filter"]: row for row in found["filters"]}["slatf-shared"]
    assert shared["fits"]
    assert shared["ram_left_bytes"] >= 0


def test_nothing_fits_is_an_answer():
    done = run("--ram", 64, "--flash", 1024)
    assert done.exit_code == 0
    assert "no filter fits" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--ram", 2048], "Missing option '--flash'"),
        (
            ["--ram", 0, "--flash", 1],
            "Invalid value for '--ram': Input should be greater than or equal to 1",
        ),
        (
            ["--ram", "2k", "--flash", 1],
            "Invalid value for '--ram': Input should be a valid integer",
        ),
        (
            ["--ram", 1, "--flash", 1, "--stack", -1],
            "Invalid value for '--stack': Input should be greater than or equal to 0",
        ),
        (["--ram", 1, "--flash", 1, "--chip", "z80"], "chip must be one of atmega328p, "),
    ],
)
def test_wrong_arguments_are_refused_by_name(arguments, message):
    done = run(*arguments)
    assert done.exit_code == 2
    assert message in " ".join(done.stderr.replace("│", "").split())


def test_figures_that_are_missing_are_said_to_be(monkeypatch, tmp_path):
    monkeypatch.setattr(_headers, "_PACKAGE", tmp_path)
    fit.figures.cache_clear()
    try:
        done = run("--ram", 1, "--flash", 1)
    finally:
        fit.figures.cache_clear()
    assert done.exit_code == 1
    assert "install it anew" in done.stderr
