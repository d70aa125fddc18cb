"""``auvest mission``: play the vehicle that the sketch ``mission`` steers, on a board or simulated.

The sketch runs on an Arduino at --port, or on a simulated one with --simulator: 'make board' builds
that, and 'python -m auvest.firmware.sketch' the .elf (firmware/README.md). Hull, current and
sensors are here: the board reads compass, gyro, log, depth and fixes over its serial line, and its
commands move the hull. Each run is set beside the same run without a chip ('auvest simulate
mission' with the same seed), and every command of the chip beside that of its own pilot on the
desk. A run takes about a minute of a processor: runs that are flown are kept beside --output until
all are, and the same command goes on from there.

Examples
--------
  auvest mission --simulator mission.ino.elf

  auvest mission --simulator mission.ino.elf --runs 20

  auvest mission --simulator mission.ino.elf --latency 0.4 --outliers 0.05

  auvest mission --port /dev/ttyACM0 --duration 60
"""

from __future__ import annotations

import hashlib
import math
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.table import Table

from auvest import montecarlo
from auvest._texts import counted, os_reason, then
from auvest.board import BoardError
from auvest.commands import options
from auvest.commands.console import Terminal, table
from auvest.commands.exit_codes import ExitCode
from auvest.commands.options import option, refuse_given
from auvest.commands.session import Floats, Session
from auvest.commands.simulate_mission import COMPASS_BIAS_DEG, mean_and_error
from auvest.commands.version import version
from auvest.simulation import mission
from auvest.simulation.mission import Mission
from auvest.simulation.vehicle_in_the_loop import (
    DELAY_S,
    PERIOD_S,
    ChipFlight,
    Vehicle,
    VehicleError,
    chip_mission,
    fly_on_desk,
    fly_simulated,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Without a line for this long, s, the board is taken for lost.
SILENCE_S = 10.0
_MISSION = Mission()


def command(
    ctx: typer.Context,
    port: options.Port = None,
    baud: options.Baud = 115200,
    simulator: options.Simulator = None,
    duration: Annotated[
        float | None,
        typer.Option(
            callback=options.positive,
            help="Seconds to fly.",
            show_default="to the end of the plan",
        ),
    ] = None,
    current: options.Current = _MISSION.current_m_s,
    current_direction: options.CurrentDirection = None,
    outliers: options.FixOutliers = 0.0,
    latency: options.FixLatency = 0.0,
    dropout: options.FixDropout = 0.0,
    compass_bias: options.CompassBias = COMPASS_BIAS_DEG,
    runs: Annotated[
        int, option(options.MONTE_CARLO, "Runs on the simulated board.", min=1, max=1000)
    ] = 1,
    seed: options.Seed = 1,
    workers: options.Workers = None,
    output: options.Output = Path("auvest-output/mission"),
    force: options.Force = False,
    no_figure: options.NoFigure = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Fly; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    options.one_board(port, simulator)
    if simulator is not None:
        refuse_given(ctx, ("baud",), "belongs to --port.")
    else:
        refuse_given(ctx, ("runs", "workers"), "belongs to --simulator.")
    with terminal.usage_errors():
        plan = chip_mission(
            **options.sea(current, current_direction, compass_bias, outliers, latency, dropout),
            runs=runs,
            seed=seed,
        )
    source = str(simulator or port)
    settings = {"source": source, "duration_s": duration, **mission.settings(plan)}
    session = Session(terminal, output, "mission", settings, force=force)
    samples = None if duration is None else max(1, round(duration / PERIOD_S))
    kept = None
    if simulator is not None:
        store = output.with_name(f"{output.name}.runs")
        with terminal.writing(store), terminal.usage_errors():
            kept = montecarlo.Store(store, _identity(settings, simulator))
    known = {run: old for run in range(runs) if kept and (old := kept.read(run, 1)) is not None}
    flights = [ChipFlight(Vehicle(plan, run)) for run in range(runs) if run not in known]
    expected = samples or round(mission.simulate(plan, record=False).duration_s.mean() / PERIOD_S)
    before = sum(int(old["samples"][0]) for old in known.values())
    with terminal.progress("samples") as progress:

        def flown() -> None:
            done = before + sum(flight.vehicle.twin.sample for flight in flights)
            progress(done, before + len(flights) * expected)

        try:
            if simulator is not None and kept is not None:

                def keep(chip: ChipFlight) -> None:
                    kept.write(chip.vehicle.run, 1, outcome(plan, chip))

                _fly_all(simulator, flights, samples, workers, flown, keep)
            elif port is not None:
                _fly_port(port, baud, flights[0], samples, flown)
        except KeyboardInterrupt:
            session.interrupted = True
        except (BoardError, VehicleError, _ConnectionLost, FileNotFoundError, ValueError) as error:
            session.trouble = str(error)  # ValueError: what was given as sketch is none
    steered = [chip for chip in flights if chip.vehicle.flight.pose]
    outcomes = known | {chip.vehicle.run: outcome(plan, chip) for chip in steered}
    if not outcomes:
        if kept is not None:
            montecarlo.discard(kept.folder)
        why = session.trouble or "interrupted"
        code = ExitCode.INTERRUPTED if session.interrupted else ExitCode.FAILED
        terminal.fail(f"the chip has not steered: {why}", code)

    first = outcomes[min(outcomes)]
    columns = montecarlo.join(
        {
            run: {name: values for name, values in one.items() if values.ndim == 1}
            for run, one in outcomes.items()
        }
    )
    values = measures(columns)
    session.write_csv("samples", _samples(first))
    session.write_csv("runs", _each_run(columns))
    if not no_figure:
        session.draw(_figure, first, source)
    session.report(values, _table(values, source))
    if len(outcomes) > 1:
        terminal.result(_runs_table(columns))
    rest = "the samples until then are kept"
    if kept is not None and (session.interrupted or session.trouble):
        done = sum(kept.read(run, 1) is not None for run in range(runs))
        rest = f"{done} of {runs} runs are done and kept; the same command goes on from there"
    elif kept is not None:
        montecarlo.discard(kept.folder)
    lost = then(session.trouble, rest) if session.trouble else ""
    differing = values["differing_commands"]
    wrong = ""
    if differing:
        are = "is not that" if differing == 1 else "are not those"
        wrong = f"{counted(differing, 'command')} of the chip {are} of its pilot here"
    session.end(rest, lost, wrong)


def _identity(settings: dict[str, Any], sketch: Path) -> dict[str, Any]:
    """Say what a run depends on: the sketch, not where it lies; not the number of runs."""
    kept = {name: value for name, value in settings.items() if name not in ("source", "runs")}
    digest = hashlib.sha256(sketch.read_bytes()).hexdigest()
    return {**kept, "sketch": digest, "version": version()}


def _fly_all(
    elf: Path,
    flights: list[ChipFlight],
    samples: int | None,
    workers: int | None,
    flown: Callable[[], None],
    keep: Callable[[ChipFlight], None],
) -> None:
    """Fly all runs, and keep each; the first failure, and Ctrl-C, ends those under way."""
    ended = Event()

    def go_on() -> None:
        flown()
        if ended.is_set():
            raise _Ended

    def fly(chip: ChipFlight) -> None:
        if ended.is_set():
            return
        try:
            fly_simulated(elf, chip, samples=samples, progress=go_on)
        except BaseException:
            ended.set()  # here, before this thread takes the next run
            raise
        keep(chip)

    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        futures = [pool.submit(fly, chip) for chip in flights]
        try:
            for future in futures:
                future.result()
        finally:
            ended.set()


class _Ended(RuntimeError):
    """Another run has failed, or Ctrl-C came."""


class _ConnectionLost(RuntimeError):
    """The port does not open, is gone, or is silent."""


def _fly_port(
    port: str, baud: int, chip: ChipFlight, samples: int | None, flown: Callable[[], None]
) -> None:
    """Play the vehicle for a board as long as its plan goes on and the board is heard."""
    try:
        import serial
    except ImportError:
        raise _ConnectionLost("--port needs pyserial: pip install 'auvest[serial]'") from None
    try:
        with serial.Serial(port, baud, timeout=0.1) as link:
            last_s = time.monotonic()
            received = b""
            while not chip.over(samples):
                received += link.readline()
                now = time.monotonic()
                if received.endswith(b"\n"):
                    answers = chip.hear(received.decode("latin-1").rstrip("\r\n"), now)
                    received, last_s = b"", now
                    text = "".join(f"{line}\r\n" for _, line in answers)
                    link.write(text.encode("latin-1"))
                    flown()
                if now - last_s > SILENCE_S:
                    raise _ConnectionLost(
                        f"{port}: no line for {SILENCE_S:g} s: does the board run mission, at "
                        f"{baud} baud? {chip.last_damage}".rstrip()
                    )
    except (serial.SerialException, OSError) as error:
        raise _ConnectionLost(f"{port}: {os_reason(error)}") from None
    finally:
        chip.vehicle.finish()


#: Columns of an outcome that runs.csv has.
_EACH_RUN = (
    "run",
    "settled_rms_m",
    "desk_settled_rms_m",
    "difference_m",
    "by_rounding_m",
    "by_delay_m",
    "all_rms_m",
)
_SAMPLES = (
    "sample",
    "north_m",
    "east_m",
    "depth_m",
    "estimate_north_m",
    "estimate_east_m",
    "leg",
    "along_m",
    "cross_m",
    "rudder_rad",
    "stern_planes_rad",
    "propeller_rev_s",
)


def outcome(plan: Mission, chip: ChipFlight) -> montecarlo.Columns:
    """Set a run beside the same run on the desk, and count what came of it: arrays with one row.

    A run that was not flown to the end is compared as far as it went. ``track`` has its samples.
    """
    vehicle, flown = chip.vehicle, chip.vehicle.flight
    count = len(flown.pose)
    desk, rounded, delayed = (
        fly_on_desk(
            plan, vehicle.run, rounded=rounded, delay_s=delay_s, samples=count
        ).settled_rms_m()
        for rounded, delay_s in ((False, 0.0), (True, 0.0), (False, DELAY_S))
    )
    settled = flown.settled_rms_m()
    last = chip.rows[-1] if chip.rows else {}
    counts = {
        "run": vehicle.run,
        "finished": int(flown.finished),
        "samples": vehicle.twin.sample,
        "commands": len(vehicle.delays_s),
        "differing_commands": vehicle.differing,
        "stack_bytes": chip.stack_bytes,
        "damaged_lines": chip.damaged,
        "serial_overruns": chip.serial_overruns,
        **{name: int(last.get(name, 0)) for name in ("refused", "missed", "implausible", "late")},
    }
    numbers = {
        "settled_rms_m": settled,
        "desk_settled_rms_m": desk,
        "difference_m": settled - desk,
        "by_rounding_m": rounded - desk,
        "by_delay_m": delayed - desk,
        "all_rms_m": flown.all_rms_m,
        "position_rms_m": flown.position_rms_m,
        "awake_share": chip.awake_share,
        "awake_s": 1e-6 * sum(row["awake_us"] for row in chip.rows[1:]),
        "reported_s": chip.rows[-1]["time_s"] - chip.rows[0]["time_s"] if chip.rows else 0.0,
        "delay_s": sum(vehicle.delays_s),
        "longest_delay_s": max(vehicle.delays_s, default=math.nan),
    }
    along, cross = flown.beside()
    pose, estimate, command = map(np.array, (flown.pose, flown.estimate_m, flown.command))
    track: list[Any] = [flown.sample, pose[:, :3], estimate, flown.leg, along, cross, command]
    return {
        **{name: np.array([value], np.int64) for name, value in counts.items()},
        **{name: np.array([value], float) for name, value in numbers.items()},
        "track": np.column_stack(track)[np.newaxis],
    }


def measures(columns: montecarlo.Columns) -> dict[str, Any]:
    """Compute the numbers of the table; shares and counts are of all runs together."""

    def total(name: str) -> int:
        return int(columns[name].sum())

    def share(name: str, of: str) -> float:
        whole = float(columns[of].sum())
        return float(columns[name].sum()) / whole if whole > 0 else math.nan

    numbers: dict[str, Any] = {
        "runs": len(columns["run"]),
        "finished_runs": total("finished"),
        "samples": total("samples"),
        "commands": total("commands"),
        "differing_commands": total("differing_commands"),
    }
    for name in ("settled_rms_m", "desk_settled_rms_m", "difference_m", "all_rms_m"):
        numbers[name], numbers[f"{name}_se"] = mean_and_error(columns[name])
    numbers["largest_difference_m"] = float(np.abs(columns["difference_m"]).max())
    for name in ("by_rounding_m", "by_delay_m", "position_rms_m"):
        numbers[name], _ = mean_and_error(columns[name])
    numbers.update(
        awake_share_simulated=float(columns["awake_share"].mean()),
        awake_share_by_board=share("awake_s", "reported_s"),
        stack_bytes=int(columns["stack_bytes"].max()),
        command_delay_s=share("delay_s", "commands"),
        longest_command_delay_s=float(np.max(columns["longest_delay_s"])),
        lines_refused=total("refused"),
        readings_missed=total("missed"),
        implausible=total("implausible"),
        late=total("late"),
        damaged_lines=total("damaged_lines"),
        serial_overruns=total("serial_overruns"),
    )
    return numbers


def _each_run(columns: montecarlo.Columns) -> dict[str, Floats]:
    return {name: columns[name].astype(float) for name in _EACH_RUN}


def _samples(one: montecarlo.Columns) -> dict[str, Floats]:
    return dict(zip(_SAMPLES, one["track"][0].T, strict=True))


def _figure(one: montecarlo.Columns, source: str) -> Figure:
    from auvest import plots  # here, because matplotlib takes long to import

    columns = _samples(one)
    time_s = (columns["sample"] - 1) * PERIOD_S
    figure = plots.new_figure((10.0, 6.0), f"{Path(source).name}: {time_s[-1]:.0f} s")
    grid = figure.add_gridspec(3, 2, width_ratios=(1.0, 1.25))
    plane = figure.add_subplot(grid[:, 0])
    wanted = mission.LAWNMOWER
    plane.plot(wanted[:, 1], wanted[:, 0], color=plots.GREY, linewidth=3, alpha=0.4, label="plan")
    north, east = columns["north_m"], columns["east_m"]
    plane.plot(east, north, color=plots.BLACK, linewidth=1.2, label="vehicle")
    north, east = columns["estimate_north_m"], columns["estimate_east_m"]
    plane.plot(east, north, color=plots.BLUE, linewidth=0.7, label="estimate")
    plane.plot(0, 0, "^", color=plots.GREEN, markersize=8, linestyle="none", label="USBL")
    plane.set(xlabel="east / m", ylabel="north / m")
    plane.set_aspect("equal", adjustable="datalim")
    plane.legend(fontsize=8)
    panels = [plane]
    for row, (label, values, colour) in enumerate(
        (
            ("cross-track / m", columns["cross_m"], plots.BLACK),
            ("rudder / deg", np.degrees(columns["rudder_rad"]), plots.VERMILION),
            ("depth / m", columns["depth_m"], plots.BLUE),
        )
    ):
        panel = figure.add_subplot(grid[row, 1], sharex=panels[1] if row else None)
        panel.plot(time_s, values, color=colour, linewidth=0.8)
        panel.set_ylabel(label)
        panels.append(panel)
    panels[-1].set_xlabel("time / s")
    for axes in panels:
        plots.style(axes)
    return figure


def _table(values: dict[str, Any], source: str) -> Table:
    def with_error(name: str) -> str:
        error = values[f"{name}_se"]
        return f"{values[name]:.4f}" + ("" if math.isnan(error) else f" ± {error:.4f}")

    simulated = math.isfinite(values["awake_share_simulated"])
    share = values["awake_share_simulated" if simulated else "awake_share_by_board"]
    rows: list[tuple[str, ...]] = [
        ("cross-track RMS, settled / m", with_error("settled_rms_m"), "from 50 m into a leg"),
        ("the same without a chip / m", with_error("desk_settled_rms_m"), "same seeds, float32"),
        ("difference / m", with_error("difference_m"), "chip and line"),
        ("  largest of a run / m", f"{values['largest_difference_m']:.4f}", "without its sign"),
        ("  of text rounded / m", f"{values['by_rounding_m']:+.4f}", "alone, on the desk"),
        (
            "  of the command's delay / m",
            f"{values['by_delay_m']:+.4f}",
            f"alone, {1e3 * DELAY_S:.0f} ms",
        ),
        ("cross-track RMS, corners too / m", with_error("all_rms_m"), ""),
        ("position error of the estimate / m", f"{values['position_rms_m']:.3f}", "RMS"),
        (
            "commands that differ",
            f"{values['differing_commands']} of {values['commands']}",
            "from those of its pilot here, to the bit",
        ),
        (
            "time awake",
            f"{100 * share:.1f} %",
            "counted by the simulator" if simulated else "by the board, without interrupts",
        ),
        ("sample to command, mean / ms", f"{1e3 * values['command_delay_s']:.1f}", ""),
        ("longest / ms", f"{1e3 * values['longest_command_delay_s']:.1f}", ""),
        ("readings missed", f"{values['readings_missed']}", "not there in time"),
        ("lines refused", f"{values['lines_refused']}", "corrupt, late or of another sample"),
        ("readings implausible", f"{values['implausible']}", "refused by the pilot"),
        ("deadlines missed", f"{values['late']}", "by more than 1 ms"),
        ("lines damaged", f"{values['damaged_lines']}", "on their way from the board"),
    ]
    if simulated:
        rows.insert(10, ("deepest stack / B", f"{values['stack_bytes']}", ""))
    title = (
        f"{source}: {values['finished_runs']} of {counted(values['runs'], 'run')} to the end, "
        f"{counted(values['samples'], 'sample')}"
    )
    return table(title, ("quantity", "value", "note"), rows, right={1})


def _runs_table(columns: montecarlo.Columns) -> Table:
    header = ("run", "settled / m", "without chip / m", "difference / m", "rounding", "delay")
    rows = [
        (f"{int(run)}", *(f"{value:.4f}" for value in cells))
        for run, *cells in zip(*list(_each_run(columns).values())[:6], strict=True)
    ]
    return table("each run", header, rows, right=set(range(6)))
