"""The sketch mission on the simulated board, with hull and sensors here: vehicle in the loop.

The pilot's C++ runs on the desk too, in float, fed the lines that the chip was sent: every command
and every estimate of the chip must be its, to the bit. What the pilot does is in tests/cpp/mission.
"""

import re
from dataclasses import dataclass, field

import numpy as np
import pytest

from auvest import mission_line, telemetry
from auvest._core import PilotMode, Status
from auvest.simulation import mission
from auvest.simulation.vehicle_in_the_loop import (
    ChipFlight,
    ChipTwin,
    Vehicle,
    chip_mission,
    fly_on_desk,
    fly_simulated,
    new_pilot,
)

pytest_plugins = ["board_support"]

OFF = (0.0, 0.0, 0.0)


@dataclass
class Play:
    """A run: what the chip reported of each sample and commanded, and what it was sent."""

    chip: ChipFlight
    sent: dict = field(default_factory=dict)
    pings: list = field(default_factory=list)
    commands: dict = field(default_factory=dict)

    def column(self, name):
        return np.array([row[name] for row in self.chip.rows])

    @property
    def modes(self):
        return [PilotMode(int(row["mode"])) for row in self.chip.rows]


class Listening(ChipFlight):
    """Notes what goes by."""

    play: Play

    def hear(self, line, time_s):
        request, command = mission_line.request(line), mission_line.command(line)
        if command is not None:
            self.play.commands[command.sample] = command.values
        answers = super().hear(line, time_s)
        if request is not None:
            self.play.sent[request.sample] = answers
            if request.ping:
                self.play.pings.append(request.sample)
        return answers


@pytest.fixture(scope="session")
def sketches(build_edited):
    """Return a function that compiles the sketch, each kind once; with a line per sample."""
    compiled = {}

    def sketch(edits=(), **settings):
        settings = {"kSamplesPerLine": "1", **settings}
        key = (tuple(edits), tuple(sorted(settings.items())))
        if key not in compiled:
            compiled[key] = build_edited("mission", edits, **settings).elf
        return compiled[key]

    return sketch


@pytest.fixture
def play(runner):
    """Return a function that flies a number of samples and replays them on the desk."""

    def play(elf, samples, *, plan=None, disturb=None, corners=mission.LAWNMOWER, **changes):
        plan = plan or chip_mission()
        vehicle = Vehicle(plan, 0, disturb, new_pilot(plan, corners, **changes))
        chip = Listening(vehicle)
        chip.play = Play(chip)
        fly_simulated(elf, chip, samples=samples, runner=runner)
        assert chip.serial_overruns == 0
        assert chip.damaged == 0
        assert vehicle.differing == 0
        assert len(vehicle.delays_s) >= (samples or len(chip.rows)) - 1
        assert_same_bits(chip, new_pilot(plan, corners, **changes))
        return chip.play

    return play


def assert_same_bits(chip, pilot):
    """Every number of every line is the desk's; they are floats, so equality means equal bits."""
    twin = ChipTwin(pilot)
    twin.start(chip.vehicle.start_line)
    for number, row in enumerate(chip.rows, start=1):
        assert row["sample"] == number
        answers = chip.play.sent[number]
        in_time = [text for delay_s, text in answers if delay_s < 0.03]
        command = twin.step(in_time, [text for delay_s, text in answers if delay_s >= 0.03])
        x, P = twin.pilot.x, twin.pilot.P
        wanted = {
            **dict(zip(("x_m", "y_m", "current_x_m_s", "current_y_m_s"), x, strict=True)),
            "P00_m2": P[0, 0],
            "P10_m2": P[1, 0],
            "P11_m2": P[1, 1],
            "heading_rad": twin.pilot.heading_rad,
            "cross_m": twin.pilot.cross_track_m,
            "mode": int(twin.pilot.mode),
            "leg": twin.pilot.leg,
            "implausible": twin.pilot.implausible,
        }
        for name, value in wanted.items():
            assert row[name] == float(value), (
                f"sample {number}, {name}: {row[name]!r} on the chip, {float(value)!r} here"
            )
        assert np.float32(chip.play.commands[number]).tobytes() == np.float32(command).tobytes()


def test_a_leg_with_the_bits_of_the_desk_and_its_cross_track(sketches, runner):
    """As it comes: in time, asleep, the desk's bits, and beside the run without chip and line."""
    samples = 800
    chip = ChipFlight(Vehicle(chip_mission(), 0))
    fly_simulated(sketches(kSamplesPerLine="5"), chip, samples=samples, runner=runner)
    vehicle = chip.vehicle
    assert vehicle.differing == 0
    assert len(vehicle.delays_s) >= samples
    last = chip.rows[-1]
    for counter in ("status", "missed", "refused", "implausible", "late"):
        assert last[counter] == 0, counter
    assert chip.serial_overruns == 0
    assert np.diff([row["time_s"] for row in chip.rows]) == pytest.approx(0.5, abs=1e-6)
    flown = vehicle.flight
    samples = len(flown.pose)
    desk = fly_on_desk(chip_mission(), 0, rounded=False, delay_s=0.0, samples=samples)
    settled = flown.settled_rms_m(), desk.settled_rms_m()
    print(
        f"settled cross-track {settled[0]:.4f} m with the chip, {settled[1]:.4f} m without; "
        f"awake {chip.awake_share:.1%}, stack {chip.stack_bytes} B, "
        f"command {1e3 * np.mean(vehicle.delays_s):.1f} ms after its sample"
    )
    # Readings are rounded to less than a hundredth of their noise, and a rudder that comes 20 ms
    # late turns 0.1 deg less: 2 cm across the track, 10 m ahead.
    assert abs(settled[0] - settled[1]) < 0.02
    assert chip.awake_share < 0.15
    assert max(vehicle.delays_s) < 0.04


def test_every_number_of_every_line(play, sketches):
    run = play(sketches(), 100)
    assert np.diff(run.pings).tolist() == [5] * (len(run.pings) - 1)
    assert run.pings[0] == 6, "the first fix is asked for 0.5 s after the start"
    assert run.column("fixes").sum() == len([k for k in run.pings if k <= 100])
    assert np.isfinite(run.column("nis")).sum() == run.column("fixes").sum()
    assert (run.column("heard") == mission_line.ALL_HEARD).all()
    assert set(run.modes) == {PilotMode.under_way}


# ---- Sensors that are silent ---------------------------------------------------------------------


def without(name, first, last):
    """Leave a sensor's lines out of these samples."""

    def disturb(sample, lines):
        silent = first <= sample <= last
        return [(0.0, line) for line in lines if not (silent and line.startswith(f"${name},"))]

    return disturb


def together(*disturbances):
    def disturb(sample, lines):
        for one in disturbances:
            lines = [text for _, text in one(sample, lines)]
        return [(0.0, line) for line in lines]

    return disturb


def test_silent_sensors(play, sketches):
    """Each stops the vehicle when its time is over, or does not; it resumes when they are back."""
    silence = together(
        without("GYRO", 11, 30),
        without("DEPTH", 41, 60),
        without("LOG", 71, 100),
        without("COMPASS", 111, 150),
    )
    run = play(sketches(kCompassHold="2"), 170, disturb=silence, compass_s=2.0)
    stopped = [k for k, mode in enumerate(run.modes, start=1) if mode != PilotMode.under_way]
    # For a second the last reading stands for the sensor, for two the gyro for the compass.
    assert stopped == [*range(21, 31), *range(51, 61), *range(131, 151)]
    assert {run.modes[k - 1] for k in stopped} == {PilotMode.silent}
    for k in range(1, 171):
        assert (run.commands[k] == OFF) == (k in stopped), k
    assert run.column("missed")[-1] == 20 + 20 + 30 + 40
    assert not run.column("status").any()
    assert not run.column("late").any()


def test_before_the_sensors_are_heard(play, sketches):
    """It waits, off, and steers from the first sample in which all that it needs has been heard."""
    silence = together(without("COMPASS", 1, 5), without("DEPTH", 1, 8), without("LOG", 1, 200))
    run = play(sketches(), 20, disturb=silence)
    assert run.modes == [PilotMode.waiting] * 8 + [PilotMode.under_way] * 12
    assert all(run.commands[k] == OFF for k in range(1, 9))
    assert run.commands[9] != OFF


def test_without_fixes_it_is_lost_and_with_them_it_is_back(play, sketches):
    """P grows until sqrt(P_xx + P_yy) is over the limit; the fixes go on being asked for."""
    run = play(sketches(kLost="1.6f"), 60, disturb=without("FIX", 1, 40), lost_m=1.6)
    known = np.sqrt(run.column("P00_m2") + run.column("P11_m2"))
    lost = np.array([mode == PilotMode.lost for mode in run.modes])
    assert lost.any()
    assert (lost == (known >= 1.6)).all()
    assert not lost[45:].any()
    assert np.diff(run.pings).tolist() == [5] * (len(run.pings) - 1)


# ---- Fixes that are late -------------------------------------------------------------------------


def test_late_fixes(play, sketches):
    """0.4 s late, all of them: the estimate is what it would be had they come at once."""
    plan = chip_mission(usbl_latency_s=0.4)
    run = play(sketches(), 150, plan=plan)
    fixed = np.flatnonzero(run.column("fixes")) + 1
    assert set(fixed - 4) == {k for k in run.pings if k + 4 <= 150}
    assert not run.column("status").any()
    assert run.column("late")[-1] == 0, "what is done again fits into the period"

    sent = {k: [text for _, text in answers] for k, answers in run.sent.items()}
    at_once = ChipTwin(new_pilot(plan))
    at_once.start(run.chip.vehicle.start_line)
    for k in range(1, 151):
        fix = [line for line in sent.get(k + 4, ()) if line.startswith("$FIX")]
        at_once.step(fix + [line for line in sent[k] if not line.startswith("$FIX")])
        if k in fixed:  # the next one is asked for in the sample after
            row = run.chip.rows[k - 1]
            assert [row["x_m"], row["y_m"]] == at_once.pilot.x[:2].tolist(), k


def test_fixes_that_are_too_late_or_too_many(play, sketches):
    """One from before the memory has a status; one of a sample to come, or a third, is refused."""

    def disturb(sample, lines):
        if sample == 60:
            lines = [mission_line.fix(30, 30.0, 0.7, 0.0), *lines]
        if sample == 70:
            lines = [mission_line.fix(75, 30.0, 0.7, 0.0), *lines]
        if sample == 80:
            lines = [mission_line.fix(80, 35.0, 0.6, 0.0)] * 3 + lines
        return [(0.0, line) for line in lines if "FIX" not in line or sample in (60, 70, 80)]

    run = play(sketches(), 90, disturb=disturb)
    status = run.column("status")
    assert status[59] == int(Status.time_backwards)
    assert not np.delete(status, 59).any()
    refused = run.column("refused")
    assert refused[68] == 0
    assert refused[69] == 1
    assert refused[-1] == 2
    assert run.column("fixes")[[59, 69, 79]].tolist() == [0, 0, 2]


def test_a_fix_between_two_samples(play, sketches):
    """It comes when it comes, here 60 ms after the request, and counts in the sample after."""

    def disturb(_, lines):
        return [(0.06 if line.startswith("$FIX") else 0.0, line) for line in lines]

    run = play(sketches(), 60, disturb=disturb)
    assert (np.flatnonzero(run.column("fixes")) + 1).tolist() == [k + 1 for k in run.pings[:-1]]
    assert run.column("refused")[-1] == 0


# ---- The end of the plan, and a track that stands still ------------------------------------------

SHORT = np.array([[20.0, 20.0], [50.0, 20.0]])
SHORT_PLAN = [
    ("plan.h", "{140, 20},  {140, 60},  {20, 60},", "{50, 20}"),
    ("plan.h", "{20, 100}, {140, 100}, {140, 140}, {20, 140}", ""),
]


def test_the_end_of_the_plan(play, sketches):
    run = play(sketches(SHORT_PLAN), None, corners=SHORT)
    flown = run.chip.vehicle.flight
    assert flown.finished
    assert flown.pose[-1][0] == pytest.approx(48, abs=0.5), "2 m before its last waypoint"
    assert run.modes[-1] == PilotMode.finished
    assert run.commands[len(run.chip.rows)] == OFF

    longer = play(sketches(SHORT_PLAN), len(run.chip.rows) + 60, corners=SHORT)
    after = longer.chip.rows[len(run.chip.rows) :]
    assert {row["mode"] for row in after} == {int(PilotMode.finished)}
    assert all(longer.commands[int(row["sample"])] == OFF for row in after)
    assert sum(row["fixes"] for row in after) > 5, "it goes on to estimate"


def test_the_law_is_not_asked_while_the_vehicle_is_stopped(play, sketches):
    """The paper's law takes a desired point that stands still for a reason to ask at T_min."""
    edits = [
        *SHORT_PLAN,
        (
            "mission.ino",
            "p.interval_s = kFixInterval;",
            "p.initial_s = kFixInterval; p.min_s = 0.1f;",
        ),
    ]
    law = {"IntervalPolicy": "auvest::MahalanobisInterval<float>"}
    finished = len(play(sketches(edits, **law), None, corners=SHORT).chip.rows)
    run = play(sketches(edits, **law), finished + 60, corners=SHORT)
    under_way = np.diff([k for k in run.pings if k < finished])
    assert np.unique(under_way).size > 2, "it adapts while the vehicle moves"
    stopped = np.diff([k for k in run.pings if k > finished])
    assert stopped.tolist() == [5] * len(stopped)
    assert len(stopped) > 8


# ---- Lines that are of no use --------------------------------------------------------------------

#: What comes instead of the gyro's line, and how many lines are refused for it.
FAULTS = {
    "nothing": ([], 0),
    "wrong checksum": (["{line}0"], 1),
    "half a line": (["{line:.12}"], 1),
    "garbage": (["\xff\xfe\x00*$$*,,\x80%"], 3),
    "much garbage": (["\xaa" * 300], 1),
    "not a number": (["nan,0.1"], 1),
    "infinite": (["inf,0.1"], 1),
    "an exponent": (["1e-3,0.1"], 1),
    "two points": (["0.1.2,0.1"], 1),
    "two signs": (["--0.1,0.1"], 1),
    "a sign only": (["-,0.1"], 1),
    "empty": ([",0.1"], 1),
    "ten digits": (["0.123456789,0.1"], 1),
    "one number": (["0.1"], 1),
    "three numbers": (["0.1,0.1,0.1"], 1),
    "another sample": ([telemetry.frame("GYRO,1,0.1,0.1")], 1),
    "no sample": ([telemetry.frame("GYRO,,0.1,0.1")], 1),
    "another instrument": ([telemetry.frame("GPGGA,123519")], 1),
    "beyond belief": (["0.1,2.1"], 0),
    "too late": (["{line}"], 0),
}
#: It is heard, although.
RECOVERIES = {
    "second try": (["$GYRO,9", "{line}"], 1),
    "twice": (["{line}", "{line}"], 1),
    "a plus of digits": (["000000.10,-.1"], 0),
}


def test_faults_cost_one_reading_and_nothing_else(play, sketches):
    cases = {**FAULTS, **RECOVERIES}
    at = {5 + 2 * i: name for i, name in enumerate(cases)}
    sent_late = {k for k, name in at.items() if name == "too late"}

    def disturb(sample, lines):
        answers = []
        for line in lines:
            if sample not in at or not line.startswith("$GYRO"):
                answers.append((0.0, line))
                continue
            delay_s = 0.06 if sample in sent_late else 0.0
            for text in cases[at[sample]][0]:
                if (
                    re.fullmatch(r"[-,.0-9a-f]*[,.0-9].*", text)
                    and "$" not in text
                    and "{" not in text
                ):
                    text = telemetry.frame(f"GYRO,{sample},{text}")
                answers.append((delay_s, text.format(line=line)))
        return answers

    run = play(sketches(), 6 + 2 * len(cases), disturb=disturb)
    refused, missed = run.column("refused"), run.column("missed")
    for sample, name in at.items():
        heard = bool(int(run.chip.rows[sample - 1]["heard"]) & 2)
        believed = heard and name != "beyond belief"
        assert believed == (name in RECOVERIES), name
        assert missed[sample - 1] - missed[sample - 2] == (not heard), name
        # A line that comes too late is refused in the sample after it.
        late = name == "too late"
        lines = refused[sample] - refused[sample - 2]
        assert lines == cases[name][1] + late, name
    assert run.column("implausible")[-1] == 1
    healthy = [k for k in range(1, len(run.chip.rows) + 1) if k not in at]
    assert (run.column("heard")[np.array(healthy) - 1] == mission_line.ALL_HEARD).all()
    assert set(run.modes) == {PilotMode.under_way}
    assert not run.column("status").any()


def test_fixes_that_cannot_be_true(play, sketches):
    """Behind the line's own checks the pilot has its own: counted, with a status, and not taken."""

    def disturb(sample, lines):
        wrong = {20: (-1.0, 0.5), 30: (2000.1, 0.5), 40: (30.0, 6.5)}.get(sample)
        extra = [] if wrong is None else [mission_line.fix(sample, *wrong, 0.0)]
        return [(0.0, line) for line in extra + lines]

    run = play(sketches(), 50, disturb=disturb)
    assert run.column("implausible")[-1] == 3
    assert np.flatnonzero(run.column("status")).tolist() == [19, 29, 39]
    assert run.column("status")[19] == int(Status.bad_parameter)


def test_it_waits_to_be_told_where_it_starts(board, sketches):
    """READY once a second, asleep in between; a plan that cannot be flown says why."""
    with board(sketches(), for_s=3.5) as running:
        lines = [event.text for event in running if hasattr(event, "text")]
    assert lines.count(telemetry.frame("READY")) == 4
    assert running.report.awake_share < 0.02
    twisted = sketches([("plan.h", "{140, 20},  {140, 60}", "{20, 20},  {140, 60}")])
    said = []
    with board(twisted, for_s=2.0) as running:
        for event in running:
            said.append(getattr(event, "text", ""))
            if mission_line.is_ready(said[-1]):
                running.send(mission_line.start(20.0, 20.0, 0.0))
    assert "# the pilot does not start: a parameter lies outside its stated range" in said
    assert not any(mission_line.command(line) for line in said)


def test_remark_on_ram_is_the_simulators_count(sketches, board):
    """After 120 lines; what it says is what the simulator counts."""
    chip = ChipFlight(Vehicle(chip_mission(), 0))
    with board(sketches(), limit_s=100.0) as running:
        for event in running:
            for delay_s, text in chip.hear(event.text, event.time_s):
                running.send(text, delay_s)
            if len(chip.rows) == 121:
                break
    (remark,) = (text for text in chip.comments if "RAM" in text)
    assert int(re.search(r"\d+", remark)[0]) == running.report.free_bytes
