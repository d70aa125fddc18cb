"""What auvest takes on the chip: measured again, compared with what is committed and promised."""

from dataclasses import replace

import pytest

from auvest.firmware import fit
from firmware import budgets
from tests.slow import ASKED, SLOW

pytest_plugins = ["board_support"]


@pytest.fixture(scope="module")
def measured(runner, example, root, tmp_path_factory):
    """All programs, compiled and run now."""
    names = [path.name for path in (root / "firmware/library/examples").iterdir()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AUVEST_BOARD", str(runner))
        return budgets.measure(
            tmp_path_factory.mktemp("budgets"), {name: example(name) for name in names}
        )


@pytest.fixture(scope="module")
def rows(measured):
    return {row.program: row for row in measured}


def committed(*targets):
    return [row for row in budgets.read_budgets() if row.target in targets]


def test_nothing_has_grown(measured):
    assert budgets.growth(measured, committed(budgets.TARGET)) == []


#: What each run measures on the other chips: the smallest filter everywhere but on the Cortex-M0+,
#: whose code is that of the M0, and another where there is no float unit. All of them are measured
#: with AUVEST_SLOW_TESTS.
ELSEWHERE = [(name, "ekf") for name in budgets.TARGETS]
ELSEWHERE.remove((budgets.TARGET, "ekf"))
ELSEWHERE.remove(("cortex-m0plus", "ekf"))
ELSEWHERE += [("cortex-m0", "robust_ekf_update"), ("riscv32imc", "robust_ekf_update")]


def test_nothing_has_grown_on_other_chips(runner, tmp_path, monkeypatch):
    monkeypatch.setenv("AUVEST_BOARD", str(runner))
    wanted = None if ASKED else ELSEWHERE
    measured = budgets.measure_elsewhere(tmp_path, wanted)
    others = committed(*budgets.TARGETS[:1], *budgets.CHIPS)
    asked = [row for row in others if wanted is None or (row.target, row.program) in wanted]
    assert len(asked) >= len(ELSEWHERE)
    assert budgets.growth(measured, asked) == []


@SLOW
def test_what_does_not_fit_an_atmega328p_has_no_row(tmp_path):
    assert budgets.measure_elsewhere(tmp_path, [(budgets.SMALL_AVR, "slatf1")]) == []


def test_every_filter_has_figures_on_every_chip():
    """But on the ATmega328P those only that fit its flash and RAM."""
    rows = {(row.target, row.program): row for row in budgets.read_budgets()}
    for target in budgets.TARGETS:
        found = {program for program in budgets.FILTERS if (target, program) in rows}
        if target == budgets.SMALL_AVR:
            assert found >= {"ekf", "ukf", "aukf", "robust_ekf_update"}
            for program in found:
                row = rows[target, program]
                assert row.flash_bytes <= 32_256
                assert row.static_ram_bytes + row.stack_bytes <= 2_048
        else:
            assert found == set(budgets.FILTERS)
    # A float unit takes the place of routines.
    assert rows["cortex-m4f", "ekf"].flash_bytes < rows["cortex-m3", "ekf"].flash_bytes


def test_pages_are_the_committed_tables():
    rows = budgets.read_budgets()
    assert budgets.PAGE.read_text() == budgets.page(rows)
    assert budgets.BOARDS_PAGE.read_text() == budgets.boards_page(rows)


def test_fit_knows_the_chips_and_filters_of_the_table():
    assert tuple(fit.CHIPS) == tuple(fit.SHORT) == budgets.TARGETS
    assert set(fit._PROGRAMS) == set(budgets.FILTERS)
    particles = {"slatf1": budgets.AVR_PARTICLES, "slatf2": budgets.AVR_PARTICLES}
    particles |= {"slatf-joint": budgets.JOINT_PARTICLES, "slatf-shared": budgets.SHARED_PARTICLES}
    for name, count in particles.items():
        assert fit.FILTERS[name].endswith(f"{count} particles")


def test_100_particles_with_one_covariance_fit_the_mega2560(rows):
    """With 500 B to spare, and awake for at most 60 % of the paper's 2 s between two pings."""
    row = rows["slatf_shared"]
    assert budgets.SHARED_PARTICLES == 100
    assert row.static_ram_bytes + row.stack_bytes <= 8_192 - 500
    assert row.cycles_max <= 0.6 * 2.0 * 16e6


def test_every_filter_and_example_is_measured(rows, root):
    examples = {path.name for path in (root / "firmware/library/examples").iterdir()}
    filters = {"ekf", "ukf", "aukf", "aukf_covariance_budget", "slatf1", "slatf2"}
    filters |= {"robust_ekf_predict", "robust_ekf_update"}
    filters |= {"unknown_start_predict", "unknown_start_update"}
    filters |= {"slatf_joint", "ekf_slat", "ekf_slat_imm"}
    assert rows.keys() >= examples | filters | {"empty"}


def test_aukf_does_what_the_design_asks(measured):
    assert [target.name for target in budgets.targets(measured) if not target.met] == []


def test_slatf_sleeps_half_of_the_sonar_period(rows, root):
    config = (root / "firmware/library/examples/slave_tracking/config.h").read_text()
    assert f"kParticles = {budgets.SKETCH_PARTICLES};" in config
    assert budgets.SKETCH_PARTICLES >= 40
    assert budgets.AVR_PARTICLES >= 40
    assert budgets.awake_share(rows["slave_tracking"]) < 0.5


def test_a_range_takes_at_most_15_000_cycles(rows):
    """In the worst case: weighted down, rejected, or with a recovery."""
    assert rows["robust_ekf_update"].cycles_max <= 15_000


def test_an_unknown_start_costs_a_range_little_once_it_is_known(rows):
    """With one component; with sixteen it must be done well before the next range, 5 s later."""
    assert rows["unknown_start_update"].cycles_median <= 17_000
    assert rows["unknown_start_update"].cycles_max <= 0.1 * 16e6


def test_guidance_and_control_take_at_most_20_000_cycles(rows):
    """In the median; an arc takes more, and so does a period that forms a part of the next leg."""
    assert budgets.MAX_GUIDANCE_CONTROL == 20_000
    for name in ("guidance_control", "pilot_steer"):
        assert rows[name].cycles_median <= budgets.MAX_GUIDANCE_CONTROL
        assert rows[name].cycles_max <= 1.4 * budgets.MAX_GUIDANCE_CONTROL


ROW = budgets.Row("atmega2560", "aukf", 10_000, 300, 400, 1_000, 2_000, 3_000)


def test_growth_up_to_the_tolerance_is_accepted():
    assert budgets.growth([replace(ROW, flash_bytes=10_200, cycles_max=3_060)], [ROW]) == []
    assert budgets.growth([replace(ROW, flash_bytes=9_000)], [ROW]) == []


@pytest.mark.parametrize(
    "name", ["flash_bytes", "static_ram_bytes", "stack_bytes", "cycles_median", "cycles_max"]
)
def test_growth_beyond_it_is_named(name):
    now = replace(ROW, **{name: int(getattr(ROW, name) * 1.021) + 1})
    (line,) = budgets.growth([now], [ROW])
    assert f"atmega2560 aukf {name}: " in line
    assert "at most 2%" in line


def test_programs_that_come_and_go_are_named():
    assert budgets.growth([ROW], []) == ["atmega2560 aukf: not in budgets.csv"]
    assert budgets.growth([], [ROW]) == ["atmega2560 aukf: no longer measured"]
    assert budgets.growth([replace(ROW, cycles_max=None)], [ROW]) == [
        "atmega2560 aukf cycles_max: None instead of 3000"
    ]


def test_table_comes_back(tmp_path):
    path = tmp_path / "budgets.csv"
    rows = [replace(ROW, program="empty", cycles_min=None), ROW]
    budgets.write_budgets(rows, path)
    assert budgets.read_budgets(path) == rows
    assert path.read_text().splitlines()[0] == ",".join(budgets.COLUMNS)
