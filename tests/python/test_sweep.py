"""Sweeps: the same rows in every way there is to compute them, and nothing computed twice."""

from __future__ import annotations

import csv
import json
import re
import shutil
import sys
from collections.abc import Iterator
from concurrent.futures import CancelledError
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kept import Kept, written
from typer.testing import CliRunner

import auvest
from auvest._outputs import new_file
from auvest.cli import app
from auvest.simulation import paper_aukf, tracking
from auvest.sweeps import dask, processes, read_plan
from auvest.sweeps.figures import heat_map, profiles
from auvest.sweeps.plan import Task, run_task
from auvest.sweeps.processes import Processes
from auvest.sweeps.result import SweepResult
from auvest.sweeps.worker import Failure, attempt
from tests import sweeps
from tests.slow import SLOW

SMALL = {
    "sweep": {"scenario": "tracking", "runs": 50, "runs_per_task": 20},
    "fixed": {"filter.kind": "aukf", "steps": 10},
    "grid": {"noise.range_m": [0.05, 0.2], "noise.dropout": [0.0, 0.2]},
}
PAGE = Path(__file__).parents[2] / "docs" / "sweeps.md"


@pytest.fixture(scope="module")
def digest(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What all rows of the small sweep give."""
    return str(sweeps.serially(SMALL, tmp_path_factory.mktemp("serial")).digest())


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    pytest.importorskip("distributed", reason="Dask is not installed")
    with sweeps.cluster() as made:
        yield made


def changed(settings: dict[str, Any], section: str, **values: Any) -> dict[str, Any]:
    return {**settings, section: {**settings.get(section, {}), **values}}


@pytest.mark.parametrize("way", sweeps.HERE[2:], ids=lambda way: way.__name__)
def test_every_way_gives_the_same_rows(way: Any, tmp_path: Path, digest: str) -> None:
    result = way(SMALL, tmp_path)
    assert result.complete
    assert result.digest() == digest


@pytest.mark.parametrize("way", sweeps.ON_DASK[::-1], ids=lambda way: way.__name__)
def test_dask_gives_the_same_rows(way: Any, tmp_path: Path, digest: str, client: Any) -> None:
    assert way(SMALL, tmp_path, client).digest() == digest


@SLOW
def test_the_long_sweep_has_one_digest(tmp_path: Path) -> None:
    found = {way(sweeps.LONG, tmp_path / way.__name__).digest() for way in sweeps.HERE}
    for way in sweeps.ON_DASK:
        with sweeps.cluster() as made:
            found.add(way(sweeps.LONG, tmp_path / way.__name__, made).digest())
    assert len(found) == 1


def test_rows_are_those_of_the_simulation() -> None:
    result = auvest.sweep(SMALL, workers=1)
    point = result.plan.points[3]
    assert (point["noise.range_m"], point["noise.dropout"]) == (0.2, 0.2)
    noise = tracking.Noise(range_m=0.2, dropout=0.2)
    scenario = tracking.Scenario(noise=noise, runs=50, steps=10)
    rows = tracking.simulate(paper_aukf.paper_filter(noise=noise), scenario).per_run()
    assert result.rows[3]["run"].tolist() == list(range(50))
    for name, values in rows.items():
        assert result.rows[3][name].tobytes() == values.tobytes(), name
    mean, error = result.values("rmse_m")
    assert mean[3] == rows["rmse_m"].mean()
    assert error[3] == pytest.approx(rows["rmse_m"].std(ddof=1) / 50**0.5, rel=1e-12)


def test_only_what_is_new_is_computed(tmp_path: Path) -> None:
    first = auvest.sweep(SMALL, output=tmp_path, workers=1)
    assert first.computed == 12  # 4 points of 20, 20 and 10 runs
    assert auvest.sweep(SMALL, output=tmp_path, workers=1).computed == 0
    wider = changed(SMALL, "grid", **{"noise.range_m": [0.05, 0.1, 0.2]})
    assert auvest.sweep(wider, output=tmp_path, workers=1).computed == 6
    longer = changed(SMALL, "sweep", runs=60)  # the last task of each point is another one
    assert auvest.sweep(longer, output=tmp_path, workers=1).computed == 4
    # What was a value of all points becomes an axis: those points are there.
    moved = changed({**SMALL, "fixed": {"steps": 10}}, "grid", **{"filter.kind": ["aukf", "ukf"]})
    assert auvest.sweep(moved, output=tmp_path, workers=1).computed == 12
    whole = changed(SMALL, "grid", **{"noise.dropout": [0, 0.2]})  # 0 is 0.0
    assert auvest.sweep(whole, output=tmp_path, workers=1).computed == 0
    other = changed(SMALL, "sweep", seed=2)
    assert auvest.sweep(other, output=tmp_path, workers=1).computed == 12


def test_a_damaged_part_is_computed_again(tmp_path: Path, digest: str) -> None:
    sweeps.serially(SMALL, tmp_path)
    parts = [tmp_path / "parts" / f"{task.key}.parquet" for task in read_plan(SMALL).tasks]
    parts[0].write_bytes(b"")  # as a power cut leaves it
    parts[1].write_bytes(parts[1].read_bytes()[:-50])
    shutil.copy(parts[4], parts[3])  # somebody has mixed up two of the same size
    again = sweeps.serially(SMALL, tmp_path)
    assert (again.computed, again.digest()) == (3, digest)


def test_the_parts_are_a_data_set_at_any_time(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    sweeps.serially(SMALL, tmp_path)
    half = new_file(tmp_path / "parts" / "another.parquet", hidden=True)
    with half as file:  # a part that is being written
        file.write(b"PAR1")
        file.flush()
        table = pandas.read_parquet(tmp_path / "parts")
    assert len(table) == 4 * 50
    one = table[(table["noise.range_m"] == 0.05) & (table["noise.dropout"] == 0.2)]
    assert sorted(one["run"]) == list(range(50))
    assert set(one["filter.kind"]) == {"aukf"}


def test_other_rows_have_another_digest(digest: str) -> None:
    result = auvest.sweep(SMALL, workers=1)
    result.rows[2]["nis"][7] = np.nextafter(result.rows[2]["nis"][7], 9)
    assert result.digest() != digest


@pytest.mark.parametrize(
    ("scenario", "grid"),
    [
        ("slat", {"level": [1, 3], "filter.kind": ["dr", "slatf2", "ekf_slat"], "masters": [2]}),
        ("cooperative", {"filter.kernel": ["unit", "igg"], "filter.rejections": [0, 5]}),
        ("mission", {"track": ["circle"], "interval.policy": ["fixed", "covariance-budget"]}),
    ],
)
def test_every_scenario_can_be_swept(scenario: str, grid: dict[str, Any]) -> None:
    short = {"slat": {"duration_s": 40.0}, "cooperative": {"steps": 60}, "mission": {}}
    fixed = {"mission": {"circle_s": 5.0}}.get(scenario, short[scenario])
    head = {"scenario": scenario, "runs": 6, "runs_per_task": 4}
    result = auvest.sweep({"sweep": head, "fixed": fixed, "grid": grid}, workers=1)
    assert result.complete
    assert all(len(rows["run"]) == 6 for rows in result.rows)
    whole = {"scenario": scenario, "runs": 6}
    assert (
        auvest.sweep({"sweep": whole, "fixed": fixed, "grid": grid}, workers=1).digest()
        == result.digest()
    )
    means, _ = result.values(result.measures[0])
    assert scenario == "mission" or len(set(means)) >= 2  # the parameters do something


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A craft that goes north for a minute, heard by two beacons."""
    folder = tmp_path / "run"
    folder.mkdir()
    rng = np.random.default_rng(1)
    (folder / "beacons.csv").write_text("source,x_m,y_m\n0,50,0\n1,0,50\n")
    lines = ["time_s,dt_s,speed_m_s,yaw_rate_rad_s"]
    lines += [f"{k},1,1.0,0.0" for k in range(60)]
    (folder / "odometry.csv").write_text("\n".join(lines) + "\n")
    truth, ranges = ["time_s,x_m,y_m,heading_rad"], ["time_s,source,range_m"]
    for k in range(1, 60):
        truth.append(f"{k},{k},0,0")
        place = np.array([50.0, 0.0]) if k % 2 == 0 else np.array([0.0, 50.0])
        ranges.append(f"{k},{k % 2},{np.hypot(*(place - [k, 0])) + 0.3 * rng.normal():.4f}")
    (folder / "truth.csv").write_text("\n".join(truth) + "\n")
    (folder / "ranges.csv").write_text("\n".join(ranges) + "\n")
    return folder


def test_a_log_is_swept_over_its_settings(log: Path, tmp_path: Path) -> None:
    config = tmp_path / "kernels.toml"
    config.write_text(
        '[sweep]\nscenario = "log"\n[fixed]\nlog = "run"\n'
        '[grid]\nfilter.kernel = ["huber", "hampel"]\nranges.sigma_m = [0.3, 3.0]\n'
    )
    result = auvest.sweep(config, output=tmp_path / "out", workers=1)
    assert result.computed == 4
    errors, _ = result.values("rmse_m")
    assert errors[0] != errors[1]
    assert np.isfinite(errors).all()
    assert auvest.sweep(config, output=tmp_path / "out", workers=1).computed == 0
    task = result.plan.tasks[0]
    with (log / "ranges.csv").open("a") as file:
        file.write("59.5,1,70\n")
    with pytest.raises(ValueError, match="is not the one that the sweep was planned with"):
        run_task(task)
    assert auvest.sweep(config, output=tmp_path / "out", workers=1).computed == 4


def test_a_list_of_points_times_a_grid() -> None:
    plan = read_plan(
        {
            "sweep": {"scenario": "tracking"},
            "points": [{"filter.kind": "ekf", "interval_s": 1.0}, {"filter": {"kind": "aukf"}}],
            "grid": {"noise": {"range_m": [0.1, 0.2]}},
        }
    )
    assert plan.axes == ("filter.kind", "interval_s", "noise.range_m")
    assert plan.points == [
        {"filter.kind": "ekf", "interval_s": 1.0, "noise.range_m": 0.1},
        {"filter.kind": "ekf", "interval_s": 1.0, "noise.range_m": 0.2},
        {"filter.kind": "aukf", "noise.range_m": 0.1},
        {"filter.kind": "aukf", "noise.range_m": 0.2},
    ]
    assert len(plan.tasks) == 4  # 100 runs take no five seconds
    assert [len(plan.part(k, 3)) for k in (1, 2, 3)] == [2, 1, 1]
    assert {t.key for k in (1, 2, 3) for t in plan.part(k, 3)} == {t.key for t in plan.tasks}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, r"\[sweep\] needs a scenario"),
        ({"sweep": {"scenario": "x"}, "grid": {"a": [1]}}, "scenario must be 'tracking', 'sl"),
        ({"sweep": {"scenario": "tracking"}}, r"nothing is swept"),
        ({**SMALL, "gird": {}}, "has no 'gird'; known are sweep, fixed, grid, points"),
        (changed(SMALL, "sweep", run=3), r"\[sweep\] has no 'run'"),
        (changed(SMALL, "sweep", runs=0), r"\[sweep\] runs must lie in 1\.\."),
        (changed(SMALL, "grid", steps=[5]), r"steps is in \[fixed\], and swept"),
        (changed(SMALL, "grid", interval_s=3), r"\[grid\] interval_s must be a list of values"),
        (changed(SMALL, "grid", **{"noise.rnage_m": [1.0]}), "noise.rnage_m is unknown; known are"),
        (changed(SMALL, "grid", stpes=[1]), "stpes is unknown; known are steps, duration_s"),
        (changed(SMALL, "grid", runs=[1]), "runs is unknown"),
        (changed(SMALL, "grid", **{"noise.centred": [1]}), r"noise.centred = 1: centred must be"),
        (changed(SMALL, "grid", interval_s=[1, 1.0]), "the same point twice: .* and .*"),
        (
            changed(SMALL, "grid", **{"filter.alpah": [1]}),
            "filter.alpah is unknown; known are alph",
        ),
        (changed(SMALL, "fixed", noise=3), "noise"),
        (
            {"sweep": {"scenario": "slat"}, "grid": {"masters": [2, 2.5]}},
            "masters = 2.5: count must be an integer",
        ),
        (changed(SMALL, "fixed", track="circle"), "track must be 'paper', 'straight' or 'turn'"),
        (changed(SMALL, "grid", **{"interval.policy": ["x"]}), "interval.policy must be 'fixed',"),
        (
            changed(SMALL, "fixed", **{"filter.kind": "slatf"}),
            "filter.kind must be 'ekf', 'ukf' or 'au",
        ),
    ],
)
def test_wrong_settings_are_refused_by_name(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_plan(settings)


def test_a_task_that_fails_ends_the_sweep_and_keeps_the_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = read_plan(SMALL)

    def failing(task: Task) -> Any:
        return Failure("no memory") if task.key == plan.tasks[5].key else attempt(task)

    monkeypatch.setattr(processes, "attempt", failing)
    with pytest.raises(auvest.SweepError, match=r"^runs 40 to 49 of \w[\w.]* = [^{}']+: no memory"):
        sweeps.serially(SMALL, tmp_path)
    monkeypatch.undo()
    assert sweeps.serially(SMALL, tmp_path).computed == 12 - 5


def test_a_task_that_ends_every_process_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "_SERVE", "import os; os.kill(os.getpid(), 9)")
    with pytest.raises(auvest.SweepError, match="has ended 3 times without an answer"):
        auvest.sweep(SMALL, executor=Processes(2))


def test_a_task_of_another_version_is_refused() -> None:
    task = replace(read_plan(SMALL).tasks[0], key="0" * 32)
    assert isinstance(attempt(task), Failure)
    with pytest.raises(ValueError, match=r"the version, the log or the settings file here \(auves"):
        run_task(task)


# On a worker: it pretends to be what must be refused, and fails if it gets a task.


def _pretend(what: str) -> None:
    import auvest._core
    import auvest.commands.version
    import auvest.sweeps.worker

    class Broken:
        ok = False

        def __repr__(self) -> str:
            return "exp: 3 of 10 wrong"

    if not hasattr(auvest, "honest"):
        auvest.honest = (  # type: ignore[attr-defined]
            auvest.commands.version.version,
            auvest._core.self_test,
            auvest.sweeps.worker.run_task,
        )
    version, self_test, run = auvest.honest  # type: ignore[attr-defined]
    other = {"version": (lambda: "0.0.9", self_test, None), "arithmetic": (version, Broken, None)}
    found = other.get(what, (version, self_test, run))
    auvest.commands.version.version = found[0]
    auvest._core.self_test = found[1]
    auvest.sweeps.worker.run_task = found[2]


@pytest.mark.parametrize(
    ("pretend", "why"),
    [
        ("version", "has auvest 0.0.9"),
        (
            "arithmetic",
            f"has auvest {auvest.__version__}, but its self-test fails (exp: 3 of 10 wrong)",
        ),
    ],
)
def test_a_worker_that_may_not_compute_gets_no_task(
    pretend: str, why: str, digest: str, client: Any, monkeypatch: Any
) -> None:
    import cloudpickle

    # As code: this module is not to be imported there.
    cloudpickle.register_pickle_by_value(sys.modules[__name__])
    client.wait_for_workers(2, timeout=300)  # the one that another test has killed comes back
    workers = sorted(client.sync(client.scheduler.identity)["workers"])
    client.run(_pretend, pretend, workers=workers[:1])
    said: list[str] = []
    executor = dask.Dask(client, warn=said.append)
    result = auvest.sweep(SMALL, executor=executor)
    assert result.digest() == digest
    assert list(executor.refused) == workers[:1]
    assert executor.refused[workers[0]] == why
    needed = f"auvest {auvest.__version__} is needed"
    assert said == [f"worker {workers[0]} is refused: it {why}; {needed}"]
    monkeypatch.setattr(dask, "_PATIENCE_REFUSED_S", 0.0)
    client.run(_pretend, pretend, workers=workers[1:])
    message = (
        rf"^no worker of the cluster can be used; {re.escape(needed)}: tcp:\S+ {re.escape(why)}; "
    )
    with pytest.raises(auvest.SweepError, match=message):
        auvest.sweep(SMALL, executor=dask.Dask(client, warn=said.append))
    client.run(_pretend, "nothing")


@pytest.mark.parametrize("error", [CancelledError("connection lost"), OSError("closed")])
def test_a_scheduler_that_goes_away_is_said(
    error: Exception, client: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(_self: Any) -> None:
        raise error

    monkeypatch.setattr(dask._Run, "_look", gone)
    with pytest.raises(auvest.SweepError, match="the scheduler is gone: c"):
        auvest.sweep(SMALL, scheduler=client)


def test_no_scheduler_is_said() -> None:
    pytest.importorskip("distributed", reason="Dask is not installed")
    with pytest.raises(auvest.SweepError, match="no scheduler at nonsense://"):
        auvest.sweep(SMALL, scheduler="nonsense://x")
    with pytest.raises(ValueError, match="workers are those of the scheduler"):
        auvest.sweep(SMALL, scheduler="tcp://x:1", workers=2)


# ---- The command ---------------------------------------------------------------------------------


def test_the_commands_of_the_page_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, client: Any
) -> None:
    page = PAGE.read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (toml,) = re.findall(r"`noise.toml`:\n\n```toml\n(.*?)```", page, re.DOTALL)
    Path("noise.toml").write_text(toml.replace("runs = 200", "runs = 4"))
    commands = re.findall(r"^\$ auvest (.*)$", page, re.MULTILINE)
    assert len(commands) == 4
    digests = {}
    for command in commands:
        command = command.replace("tcp://head:8786", client.scheduler.address)
        done = CliRunner().invoke(app, [*command.split(), "--json", "--quiet", "--no-figure"])
        assert done.exit_code == 0, done.output
        document = json.loads(done.stdout)
        digests[command] = document["digest"] if document["complete"] else None
    assert list(digests.values()).count(None) == 1  # the part
    assert len(set(digests.values())) == 2
    script = re.findall(r"^auvest (.*)$", page, re.MULTILINE)
    assert len(script) == 1
    array = (
        script[0].replace('"$SLURM_ARRAY_TASK_ID/8"', "2/8").replace("noise --quiet", "noise-array")
    )
    array = array.replace('"$SLURM_CPUS_PER_TASK"', "1")
    done = CliRunner().invoke(app, [*array.split(), "--json", "--no-figure"])
    assert json.loads(done.stdout)["missing_tasks"] == 12


def test_the_command_writes_what_it_shows(tmp_path: Path, kept: Kept) -> None:
    config = tmp_path / "s.toml"
    config.write_text(
        '[sweep]\nscenario = "tracking"\nruns = 5\n[fixed]\nsteps = 5\n[grid]\n'
        "noise.range_m = [0.05, 0.2]\nnoise.dropout = [0.0, 0.3]\n"
    )
    out = tmp_path / "out"
    arguments = ["sweep", str(config), "--output", str(out), "--workers", "1"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    kept("sweep.txt", done.stdout + done.stderr + written(out))
    result = auvest.sweep(config, output=out, workers=1)
    assert result.computed == 0
    mean, _ = result.values("rmse_m")
    with (out / "table.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert [float(line["rmse_m"]) for line in lines] == mean.tolist()
    assert [line["noise.range_m"] for line in lines] == ["0.05", "0.05", "0.2", "0.2"]
    assert json.loads((out / "results.json").read_text())["digest"] == result.digest()
    for name in ("heat_map", "profiles"):
        assert (out / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert b"<svg" in (out / f"{name}.svg").read_bytes()
    for asked, shown in (((), "rmse_m"), (("--measure", "nis"), "nis")):
        again = CliRunner().invoke(app, [*arguments, *asked, "--no-figure", "--json", "--quiet"])
        assert json.loads(again.stdout)["measure"] == shown
    wrong = CliRunner().invoke(app, [*arguments, "--measure", "rsme"])
    assert wrong.exit_code == 2
    assert "measure must be one of rmse_m, nis" in wrong.stderr


def test_the_pictures_show_the_means() -> None:
    grid = {"noise.range_m": [0.05, 0.2], "noise.dropout": [0.0, 0.2], "interval.tau0": [0.1, 0.5]}
    result = auvest.sweep({**SMALL, "grid": grid}, workers=1)
    mean = result.values("rmse_m")[0].reshape(2, 2, 2)  # range noise, dropout, tau0
    panels = [axes for axes in heat_map(result).axes if axes.images]
    assert [axes.get_title(loc="left") for axes in panels] == [
        f"interval.tau0 = {t}" for t in (0.1, 0.5)
    ]
    for number, axes in enumerate(panels):
        assert np.array_equal(axes.images[0].get_array(), mean[:, :, number])
        assert axes.texts[1].get_text() == f"{mean[0, 1, number]:.3g}"
    for axis, axes in enumerate(profiles(result).axes):
        *thin, thick = axes.get_lines()
        assert len(thin) == 4
        others = tuple({0, 1, 2} - {axis})
        assert thick.get_ydata() == pytest.approx(mean.mean(axis=others), rel=1e-12)
        assert {tuple(line.get_ydata()) for line in thin} == {
            tuple(row) for row in np.moveaxis(mean, axis, -1).reshape(4, 2).tolist()
        }


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("x")
    config = tmp_path / "s.toml"
    config.write_text('[sweep]\nscenario = "tracking"\n[grid]\nsteps = [1]\n')
    done = CliRunner().invoke(app, ["sweep", str(config), "--output", str(tmp_path)])
    assert done.exit_code == 2
    assert f"{tmp_path} holds what auvest has not written: choose another folder" in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.txt", "s.toml"]


@pytest.mark.parametrize("part", ["0/3", "4/3", "1", "a/b"])
def test_a_part_that_there_is_not_is_refused(part: str, tmp_path: Path) -> None:
    config = tmp_path / "s.toml"
    config.write_text('[sweep]\nscenario = "tracking"\n[grid]\nsteps = [1]\n')
    done = CliRunner().invoke(
        app, ["sweep", str(config), "--part", part, "--output", str(tmp_path / "o")]
    )
    assert done.exit_code == 2


def test_a_result_has_a_line_for_each_point_and_all_rows_in_one_table() -> None:
    """Means are over the runs that did not fail and have a number; of one there is no error."""
    rows = [
        {
            "run": np.arange(5),
            "status": np.array([0, 0, 1, 0, 0]),
            "finished": np.array([1, 1, 1, 0, 1]),
            "x": np.array([1.0, 3.0, 100.0, 1000.0, np.nan]),
            "y": np.array([5.0, 9.0, 100.0, 1000.0, 7.0]),
        },
        {},
        {
            "run": np.array([0]),
            "status": np.array([0]),
            "finished": np.array([1]),
            "x": np.array([8.0]),
            "y": np.array([-1.5]),
        },
        {},
    ]
    result = SweepResult(read_plan(SMALL), rows, missing=2, computed=1)
    lines = [
        {"noise.range_m": 0.05, "noise.dropout": 0.0, "runs": 5, "failed_runs": 2,
         "x": 2.0, "x_se": 1.0, "y": 7.0, "y_se": 2 / 3**0.5},
        {"noise.range_m": 0.05, "noise.dropout": 0.2, "runs": 0, "failed_runs": 0,
         "x": np.nan, "x_se": np.nan, "y": np.nan, "y_se": np.nan},
        {"noise.range_m": 0.2, "noise.dropout": 0.0, "runs": 1, "failed_runs": 0,
         "x": 8.0, "x_se": np.nan, "y": -1.5, "y_se": np.nan},
        {"noise.range_m": 0.2, "noise.dropout": 0.2, "runs": 0, "failed_runs": 0,
         "x": np.nan, "x_se": np.nan, "y": np.nan, "y_se": np.nan},
    ]  # fmt: skip
    table = result.table()
    assert [list(line) for line in table] == [list(line) for line in lines]
    for found, line in zip(table, lines, strict=True):
        np.testing.assert_allclose([*found.values()], [*line.values()], rtol=1e-15)
    columns = result.columns()
    assert columns["noise.range_m"].tolist() == [0.05] * 5 + [0.2]
    assert columns["noise.dropout"].tolist() == [0.0] * 6
    assert columns["run"].tolist() == [0, 1, 2, 3, 4, 0]
    assert columns["y"].tolist() == [5.0, 9.0, 100.0, 1000.0, 7.0, -1.5]
    assert not result.complete
    assert result.measures == ["x", "y"]
    assert (result.measure, result.showing("y").measure) == ("x", "y")
    with pytest.raises(ValueError, match=r"^measure must be one of x, y, not 'z'$"):
        result.showing("z")
    assert replace(result, rows=[{}] * 4).columns() == {}
