"""The registry of filters agrees with the package, the commands, the records and the budgets."""

from __future__ import annotations

import json
from typing import get_args

import pytest
from typer.testing import CliRunner

import auvest
from auvest.cli import app
from auvest.registry import FILTERS, filter_named, replayable
from auvest.replay.config import FilterName
from firmware.budgets import read_budgets
from firmware.parity import slatf
from tests.parity import records, robust_records


def test_every_line_names_a_class_and_models_of_the_package() -> None:
    for entry in FILTERS.values():
        assert isinstance(getattr(auvest, entry.cls), type)
        for model in (*entry.processes, *entry.sensors):
            assert isinstance(getattr(auvest, model), type)


def test_a_filter_is_on_the_chip_or_the_line_says_why_not() -> None:
    for entry in FILTERS.values():
        assert entry.chip or entry.note
        assert entry.chip or not (entry.parity or entry.budget)


def test_replay_takes_what_the_registry_says() -> None:
    assert list(get_args(FilterName)) == replayable()


def test_every_filter_that_claims_parity_has_a_record() -> None:
    replayed = {record.kind for record in records.all_records()}
    kinds = {record.filter.__name__ for record in robust_records.all_records()}
    replayed |= {name for name, entry in FILTERS.items() if entry.cls in kinds}
    # Of a SLAT record the kind begins with the filter's name; motion and master follow.
    slat_kinds = {f"{record.kind}-" for record in slatf.all_records(chip=True).values()}
    slat_names = {name for name, entry in FILTERS.items() if entry.family == "slat"}
    replayed |= {name for name in slat_names if any(k.startswith(f"{name}-") for k in slat_kinds)}
    assert {name for name, entry in FILTERS.items() if entry.parity} == replayed


def test_every_filter_that_claims_a_budget_has_a_row() -> None:
    rows = {row.program for row in read_budgets()}
    for name, entry in FILTERS.items():
        program = name.replace("-", "_")
        has = program in rows or f"{program}_update" in rows
        assert entry.budget == has, name


def test_an_unknown_name_is_refused_with_those_that_exist() -> None:
    with pytest.raises(ValueError, match=r"filter must be ekf, ukf, ckf, aukf, .* not 'kf'"):
        filter_named("kf")
    with pytest.raises(ValueError, match="not 'dead-reckoning'"):
        filter_named("dead-reckoning", replayable())


def test_the_command_prints_the_registry() -> None:
    result = CliRunner().invoke(app, ["filters", "--json"])
    assert result.exit_code == 0
    rows = json.loads(result.stdout)
    assert [row["name"] for row in rows] == list(FILTERS)
    for row in rows:
        assert row["python"] is True
        for place in ("replay", "chip", "parity", "budget"):
            assert row[place] is getattr(FILTERS[row["name"]], place)
        assert row["processes"]
        assert row["sensors"]
    shown = CliRunner().invoke(app, ["filters"])
    assert shown.exit_code == 0
    assert all(name in shown.stdout for name in FILTERS)
