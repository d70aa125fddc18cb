"""``auvest capture``: record what a sketch reports, on a board or simulated.

The sketch runs on an Arduino at --port, or on a simulated one with --simulator, where the vehicle
and its sonar are simulated too. --play-sonar simulates them for a board that has no sonar.
Any sketch is recorded that names its columns, as tracking_loop does ($COLUMNS, telemetry.h).
In a terminal the last samples are drawn while they come; --live draws all of them on a page.
Every sample is in the CSV file as soon as it has come, with all the bits of its floats, until the
end in a folder whose name ends in .unfinished; Ctrl-C ends a recording and keeps it. Where the
board was reset under way, a new section of the file begins.

Examples
--------
  auvest capture --simulator tracking_loop.ino.elf

  auvest capture --simulator tracking_loop.ino.elf --noise lognormal --dropout 0.2

  auvest capture --port /dev/ttyACM0 --output dive-7 --live

  auvest capture --port /dev/ttyACM0 --play-sonar --steps 60
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.table import Table

from auvest import MahalanobisInterval, RangeBearing, metrics, telemetry
from auvest._texts import NIS_OFF, counted, os_reason, then
from auvest.board import Board, BoardError, Finished, PinChange, SerialLine
from auvest.commands import options
from auvest.commands.console import Terminal, table
from auvest.commands.exit_codes import ExitCode
from auvest.commands.live import LivePage, terminal_view
from auvest.commands.options import WORLD, fraction, option, refuse_given
from auvest.commands.session import Floats, Session
from auvest.simulation import paper_aukf
from auvest.simulation.paper_aukf import observed_positions
from auvest.simulation.tracking import Noise, Track
from auvest.telemetry import Boot, LineError, Reader, Resumed, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The pin that the sketch triggers its sonar with: D8 of an Arduino MEGA2560.
TRIGGER_PIN = "PORTH5"
#: Without a sample for this long, s, and for three intervals, the board is taken for lost.
SILENCE_S = 10.0
SOUND_M_S = 1500.0

_NOISE = paper_aukf.paper_noise()


class SimulatedSonar:
    """A vehicle on the paper's track, and the sonar that measures it.

    Parameters
    ----------
    noise : Noise
        Of the two measurements; its dropouts are answers that never come.
    seed : int
        Of the noise.
    station : (float, float)
        Where the sonar is, m.
    processing_s : float
        What the sonar takes besides the way of the sound, s.

    Attributes
    ----------
    truth : dict of int to (float, float)
        True position at each sample asked for, m.
    """

    def __init__(
        self,
        noise: Noise = _NOISE,
        *,
        seed: int = 1,
        station: tuple[float, float] = RangeBearing().station,
        processing_s: float = 2e-3,
    ) -> None:
        self.truth: dict[int, tuple[float, float]] = {}
        self._noise = noise
        self._random = np.random.default_rng(seed)
        self._station = station
        self._processing_s = processing_s
        self._track = Track(kind="straight")
        self._start_s: float | None = None

    def measure(self, sample: int, now_s: float) -> tuple[str, float] | None:
        """Answer a request: the line, and how long after the trigger it comes (s), or nothing.

        The sketch takes its first sample one initial interval after the start of the track.
        """
        if self._start_s is None:
            self._start_s = now_s - MahalanobisInterval().initial_s
        x, y = self.truth[sample] = self._track.position_at(now_s - self._start_s)
        range_error, bearing_error, lost = self._draw()
        dx, dy = x - self._station[0], y - self._station[1]
        distance = math.hypot(dx, dy)
        bearing = math.remainder(math.atan2(dy, dx) + bearing_error, math.tau)
        if lost:
            return None
        delay = self._processing_s + 2 * distance / SOUND_M_S
        return telemetry.answer(sample, distance + range_error, bearing), delay

    def restart(self) -> None:
        """Put the vehicle at the start of its track: the board has begun anew."""
        self._start_s = None
        self.truth.clear()

    def _draw(self) -> tuple[float, float, bool]:
        noise, random = self._noise, self._random
        unit = random.uniform(size=2) if noise.kind == "uniform" else random.normal(size=2)
        if noise.kind == "lognormal":
            unit = np.exp(unit)
        errors = unit * (noise.range_m, noise.bearing_rad)
        if noise.centred:
            errors -= replace(noise, centred=False).mean
        return float(errors[0]), float(errors[1]), bool(random.uniform() < noise.dropout)


@dataclass(frozen=True)
class Restart:
    """The board has begun anew under way.

    Attributes
    ----------
    after_s : float
        The time of the last sample before it, s.
    section : int
        The section that it begins, of those in the file.
    reason : str
        Why.
    """

    after_s: float
    section: int
    reason: str


@dataclass(frozen=True)
class Resumption:
    """A section goes on from a checkpoint of the board.

    Attributes
    ----------
    section : int
    checkpoint : int
        Its sequence number; 0: there was none.
    least_age_s, most_age_s : float
        Bounds of its age, s.
    """

    section: int
    checkpoint: int
    least_age_s: float
    most_age_s: float


@dataclass
class Recording:
    """What has been heard so far; every sample is on the disk as soon as it has come.

    Attributes
    ----------
    path : Path
        The CSV file.
    sonar : SimulatedSonar or None
        Who answers the sketch; None: somebody else.
    rows : list of dict
        Samples; the first column counts the sections, which begin where the board does.
    triggered_s : dict of (int, int) to float
        When each sample of each section was asked for, in the time of who calls `hear`.
    restarts : list of Restart
        Where the board has begun anew.
    resumptions : list of Resumption
        From what, of a sketch that keeps checkpoints.
    damaged : int
        Lines that could not be read.
    last_damage : str
        What was wrong with the last of them.
    awake_share : float
        NaN as long as nobody but the board has measured it.
    """

    path: Path
    sonar: SimulatedSonar | None
    rows: list[Row] = field(default_factory=list)
    triggered_s: dict[tuple[int, int], float] = field(default_factory=dict)
    restarts: list[Restart] = field(default_factory=list)
    resumptions: list[Resumption] = field(default_factory=list)
    damaged: int = 0
    last_damage: str = ""
    awake_share: float = math.nan

    def __post_init__(self) -> None:
        self._reader = Reader()
        self._section = 1
        self._file = self.path.open("w", encoding="utf-8", newline="")

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def hear(self, line: str, triggered_s: float) -> tuple[str, float] | None:
        """Take a line, and give the sonar's answer to it with its delay (s), if there is one."""
        sample = telemetry.requested_sample(line)
        if sample is not None:
            self.triggered_s[self._section, sample] = triggered_s
            return None if self.sonar is None else self.sonar.measure(sample, triggered_s)
        try:
            said = self._reader.read(line)
            if isinstance(said, Boot):
                self._begin(said.reason)
            elif isinstance(said, Resumed):
                self._begin("not said: that line was lost")
                age = said.least_s, said.most_s
                self.resumptions.append(Resumption(self._section, said.sequence, *age))
            elif said is not None:
                self._add(said)
        except LineError as error:
            self.damaged += 1
            self.last_damage = str(error)
        return None

    @property
    def trouble(self) -> str:
        """What keeps samples from coming, as far as the lines tell."""
        if not self._reader.kind and self._reader.others:
            kinds = ", ".join(sorted(f"${kind}" for kind in self._reader.others))
            return f"lines have come ({kinds}), but the names of no columns: reset the board"
        return self.last_damage

    def _begin(self, reason: str) -> None:
        """Begin a new section, if there is one to end."""
        if not self.rows or self.rows[-1]["section"] != self._section:
            return
        self._section += 1
        self.restarts.append(Restart(self.rows[-1].get("time_s", math.nan), self._section, reason))
        if self.sonar is not None:
            self.sonar.restart()

    def _add(self, row: Row) -> None:
        if self.rows and self.rows[-1]["section"] == self._section and "sample" in row:
            sample, last = row["sample"], self.rows[-1]["sample"]
            if sample == last:
                raise LineError(f"sample {sample:g} has come twice")
            if sample < last:
                self._begin("not said: that line was lost")
        row = {"section": self._section, **row}
        if self.sonar is not None:
            unknown = (math.nan, math.nan)
            sample = int(row.get("sample", 0))
            row["true_x_m"], row["true_y_m"] = self.sonar.truth.get(sample, unknown)
        if not self.rows:
            self._file.write(",".join(row) + "\n")
        # Nine digits are all the bits of a float, twelve are a time to 1 us.
        cells = ("" if value != value else f"{value:.12g}" for value in row.values())
        self._file.write(",".join(cells) + "\n")
        self._file.flush()
        self.rows.append(row)

    def column(self, name: str) -> Floats:
        """Collect one column, NaN where it is missing."""
        return np.array([row.get(name, math.nan) for row in self.rows])

    def columns(self, *names: str) -> Floats:
        """Collect columns side by side."""
        return np.stack([self.column(name) for name in names], axis=-1)

    @property
    def elapsed_s(self) -> Floats:
        """Times of the samples, s, those of each section behind the one before."""
        time_s = self.column("time_s")
        elapsed_s = time_s.copy()
        for begin in np.flatnonzero(np.diff(self.column("section"))) + 1:
            elapsed_s[begin:] = time_s[begin:] + elapsed_s[begin - 1]
        return elapsed_s

    def at_the_ends(self, name: str) -> Floats:
        """Collect what a column has at the end of each section."""
        ends = np.append(np.diff(self.column("section")) > 0, True)
        return self.column(name)[ends]

    @property
    def announced_s(self) -> float:
        """The longer of the last two intervals that the sketch has announced, s."""
        return max((row.get("interval_s", 0.0) for row in self.rows[-2:]), default=0.0)

    @property
    def timing_error_s(self) -> float:
        """How far the triggers lie from the moments in the lines, at most, s."""
        worst = math.nan
        for section in range(1, self._section + 1):
            pairs = [
                (row["time_s"], self.triggered_s[section, int(row["sample"])])
                for row in self.rows
                if row["section"] == section
                and (section, int(row.get("sample", 0))) in self.triggered_s
            ]
            if pairs:
                said, seen = np.array(pairs).T
                error = np.abs((seen - seen[0]) - (said - said[0])).max()
                worst = float(np.fmax(worst, error))
        return worst


def command(
    ctx: typer.Context,
    port: options.Port = None,
    baud: options.Baud = 115200,
    simulator: options.Simulator = None,
    steps: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=100_000,
            help="Samples to record.",
            show_default=f"{paper_aukf.STEPS} simulated, until Ctrl-C from a port",
        ),
    ] = None,
    station: Annotated[
        tuple[float, float],
        typer.Option(metavar="X Y", help="Where the station is, m, as in the sketch."),
    ] = RangeBearing().station,
    play_sonar: Annotated[
        bool, option(WORLD, "Answer the board at --port as sonar.", "--play-sonar")
    ] = False,
    noise: options.Noise = "normal",
    range_noise: options.RangeNoise = _NOISE.range_m,
    bearing_noise: options.BearingNoise = _NOISE.bearing_rad,
    dropout: Annotated[
        float, option(WORLD, "Probability that an answer never comes.", check=fraction)
    ] = 0.0,
    seed: options.Seed = 1,
    live: Annotated[
        bool, typer.Option("--live", help="Serve a page that draws the recording; says where.")
    ] = False,
    output: options.Output = Path("auvest-output/capture"),
    force: options.Force = False,
    no_figure: options.NoFigure = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Record; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    options.one_board(port, simulator)
    played = simulator is not None or play_sonar
    if simulator is not None:
        steps = steps or paper_aukf.STEPS
        refuse_given(ctx, ("baud", "play_sonar"), "belongs to --port.")
    if not played:
        world = ("noise", "range_noise", "bearing_noise", "dropout", "seed")
        refuse_given(ctx, world, "belongs to --simulator or --play-sonar.")

    sensor = RangeBearing(station=station)
    errors = paper_aukf.paper_noise(
        noise, range_m=range_noise, bearing_rad=bearing_noise, dropout=dropout
    )
    sonar = SimulatedSonar(errors, seed=seed, station=sensor.station) if played else None
    settings: dict[str, Any] = {
        "source": str(simulator or port),
        "steps": steps,
        "station": list(sensor.station),
    }
    if played:
        settings.update(noise=asdict(errors), seed=seed)
    recorded = port is not None  # not simulated: it cannot be made again
    path = output / "record.csv"
    if recorded and path.exists() and not force:
        terminal.fail(
            f"{path} exists and will not be overwritten: choose another --output", ExitCode.USAGE
        )
    session = Session(terminal, output, "capture", settings, force=force, precious=recorded)

    with terminal.writing(output):
        recording = Recording(session.part / path.name, sonar)
        source = settings["source"]
        with ExitStack() as shown:
            if live:
                page = shown.enter_context(LivePage(recording, Path(source).name))
                terminal.warn(f"the recording is drawn at {page.url}")
            bars = terminal.shows_bars
            progress = shown.enter_context(
                terminal.progress("samples", lambda: terminal_view(recording, bars=bars))
            )

            def wanted() -> bool:
                done = len(recording.rows)
                progress(done, steps or done)
                return steps is None or done < steps

            try:
                if simulator is not None:
                    limit_s = 10 + 2 * (steps or 0)  # the longest interval is 1 s
                    run_simulated(simulator, recording, wanted, limit_s)
                elif port is not None:
                    _listen(port, baud, recording, wanted)
            except KeyboardInterrupt:
                session.interrupted = steps is not None
            except (BoardError, _ConnectionLost, FileNotFoundError, ValueError) as error:
                session.trouble = str(error)  # ValueError: what was given as sketch is none
            finally:
                recording.close()
    if not recording.rows:
        recording.path.unlink(missing_ok=True)
        why = session.trouble or recording.trouble or "interrupted"
        code = ExitCode.INTERRUPTED if session.interrupted else ExitCode.FAILED
        terminal.fail(f"no sample has come: {why}", code)

    values = measures(recording, simulated=simulator is not None)
    for restart in recording.restarts:
        terminal.warn(
            f"the board restarted after {restart.after_s:.6g} s: section {restart.section} begins; "
            f"why: {restart.reason}"
        )
    session.add("record", path)
    if not no_figure:
        session.draw(_figure, recording, sensor, source)
    session.report(values, _table(values, source))
    kept = f"{values['samples']} of {steps} samples are kept"
    lost = then(session.trouble, "the samples until then are kept") if session.trouble else ""
    session.end(kept, lost)


def run_simulated(
    elf: Path, recording: Recording, wanted: Callable[[], bool], limit_s: float
) -> None:
    """Run the sketch on a simulated board as long as samples are wanted.

    Parameters
    ----------
    elf : Path
        The compiled sketch.
    recording : Recording
        Takes the lines; its sonar answers.
    wanted : callable
        Asked after each event.
    limit_s : float
        Simulated time after which the run has failed, s.

    Raises
    ------
    BoardError
        If the sketch does what no chip should do.
    FileNotFoundError
        If the simulator is not there.
    """
    triggered_s = 0.0
    with Board(elf, watch=[TRIGGER_PIN], limit_s=limit_s) as board:
        for event in board:
            if isinstance(event, PinChange) and event.level:
                triggered_s = event.time_s
            if isinstance(event, SerialLine):
                answer = recording.hear(event.text, triggered_s)
                if answer is not None:
                    text, delay_s = answer
                    board.send(text, max(0.0, triggered_s + delay_s - event.time_s))
            if isinstance(event, Finished) or not wanted():
                break
    recording.awake_share = board.report.awake_share


class _ConnectionLost(RuntimeError):
    """The port does not open, is gone, or is silent."""


def _listen(port: str, baud: int, recording: Recording, wanted: Callable[[], bool]) -> None:
    """Record from a serial port as long as samples are wanted and the board is heard."""
    try:
        import serial
    except ImportError:
        raise _ConnectionLost("--port needs pyserial: pip install 'auvest[serial]'") from None
    try:
        with serial.Serial(port, baud, timeout=0.1) as link:
            last_s = time.monotonic()
            received = b""
            while wanted():
                received += link.readline()
                now = time.monotonic()
                if received.endswith(b"\n"):
                    known = len(recording.rows)
                    answer = recording.hear(received.decode("latin-1").rstrip("\r\n"), now)
                    received = b""
                    if answer is not None:
                        text, delay_s = answer
                        time.sleep(delay_s)
                        link.write(f"{text}\r\n".encode("latin-1"))
                    if len(recording.rows) > known:
                        last_s = now
                patience_s = max(SILENCE_S, 3 * recording.announced_s)
                if now - last_s > patience_s:
                    raise _ConnectionLost(
                        f"{port}: no sample for {patience_s:g} s: does the board run a sketch "
                        f"that names its columns, at {baud} baud? {recording.trouble}".rstrip()
                    )
    except (serial.SerialException, OSError) as error:
        raise _ConnectionLost(f"{port}: {os_reason(error)}") from None


def measures(recording: Recording, *, simulated: bool) -> dict[str, Any]:
    """Compute the numbers of the table; NaN where the sketch does not report them."""
    nis = recording.column("nis")
    known = nis[np.isfinite(nis)]
    elapsed_s = recording.elapsed_s
    span = float(elapsed_s[-1] - elapsed_s[0])
    awake = float(recording.column("awake_us")[1:].sum()) * 1e-6
    error = recording.columns("x_m", "y_m") - recording.columns("true_x_m", "true_y_m")
    status = recording.column("status")
    return {
        "samples": len(recording.rows),
        "missed": _count(recording.at_the_ends("missed")),
        "refused_answers": _count(recording.at_the_ends("refused")),
        "late": _count(recording.at_the_ends("late")),
        "not_ok": _count(np.where(np.isfinite(status), status != 0, np.nan)),
        "damaged_lines": recording.damaged,
        "restarts": [asdict(restart) for restart in recording.restarts],
        "resumptions": [asdict(resumption) for resumption in recording.resumptions],
        "duration_s": span,
        "mean_interval_s": float(recording.column("dt_s").mean()),
        "nis_mean": float(known.mean()) if known.size else math.nan,
        "awake_share_simulated": recording.awake_share,
        "awake_share_by_board": awake / span if span > 0 else math.nan,
        "worst_timing_error_s": recording.timing_error_s if simulated else math.nan,
        "rmse_m": metrics.rmse(error) if np.isfinite(error).any() else math.nan,
    }


def _count(values: Floats) -> int | float:
    total = float(values.sum())
    return int(total) if math.isfinite(total) else math.nan


def _figure(recording: Recording, sensor: RangeBearing, source: str) -> Figure:
    from auvest import plots  # here, because matplotlib takes long to import

    title = f"{Path(source).name}: {counted(len(recording.rows), 'sample')}"
    if not {"x_m", "y_m", "nis", "interval_s", "range_m"} <= set(recording.rows[0]):
        drawn = [name for name in recording.rows[0] if name not in ("section", "sample", "time_s")]
        return plots.columns_figure(
            recording.elapsed_s, {name: recording.column(name) for name in drawn}, title=title
        )
    return plots.capture_figure(
        recording.columns("x_m", "y_m"),
        recording.columns("desired_x_m", "desired_y_m"),
        observed_positions(recording.columns("range_m", "bearing_rad"), sensor.station),
        recording.columns("true_x_m", "true_y_m"),
        station=sensor.station,
        time_s=recording.elapsed_s,
        interval_s=recording.column("interval_s"),
        sigma_m=np.sqrt(recording.column("P00_m2") + recording.column("P11_m2")),
        nis=recording.column("nis"),
        title=title,
    )


def _table(values: dict[str, Any], source: str) -> Table:
    counts = (
        ("missed", "missed measurements", "predicted only"),
        ("refused_answers", "answers refused", "corrupt, or to another sample"),
        ("late", "deadlines missed", "by more than 1 ms"),
        ("not_ok", "status not ok", "samples"),
        ("damaged_lines", "lines damaged", "on their way from the board"),
    )
    rows = [(name, f"{values[key]}", note) for key, name, note in counts if values[key] >= 0]
    if values["restarts"]:
        rows.append(("restarts of the board", f"{len(values['restarts'])}", "a section each"))
    kept = [one for one in values["resumptions"] if one["checkpoint"] > 0]
    if kept:
        of = f"{len(kept)} of {len(values['resumptions'])}"
        age = f"{kept[-1]['least_age_s']:.6g} to {kept[-1]['most_age_s']:.6g} s old"
        rows.append(("starts from a checkpoint", of, f"the last from {age}"))
    if math.isfinite(values["mean_interval_s"]):
        rows.append(("mean interval / s", f"{values['mean_interval_s']:.4f}", ""))
    if math.isfinite(values["nis_mean"]):
        rows.append(("NIS, mean", f"{values['nis_mean']:.3f}", f"expected 2; {NIS_OFF}"))
    if math.isfinite(values["awake_share_simulated"]):
        share = 100 * values["awake_share_simulated"]
        rows.append(("time awake", f"{share:.2f} %", "counted by the simulator"))
    elif math.isfinite(values["awake_share_by_board"]):
        share = 100 * values["awake_share_by_board"]
        rows.append(("time awake", f"{share:.2f} %", "counted by the board, without interrupts"))
    if math.isfinite(values["worst_timing_error_s"]):
        error = 1e3 * values["worst_timing_error_s"]
        rows.append(("worst timing error / ms", f"{error:.3f}", "trigger against commanded moment"))
    if math.isfinite(values["rmse_m"]):
        rows.append(("position RMSE / m", f"{values['rmse_m']:.4f}", "against the simulated truth"))
    title = f"{source}: {counted(values['samples'], 'sample')} in {values['duration_s']:.1f} s"
    return table(title, ("quantity", "value", "note"), rows, right={1})
