"""The whole loop on the chip: asleep, woken by its timer, answered by a sonar, right to the bit."""

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from auvest import CovarianceBudget, FixedInterval, MahalanobisInterval, Status, telemetry
from auvest.cli import app

pytest_plugins = ["closed_loop_support"]

IMPLAUSIBLE = 14  # of Status in auvest/status.hpp


def fixed(interval_s):
    """C++ for a policy that always takes this interval."""
    return (
        "struct Always : auvest::FixedInterval<float> "
        f"{{ Always() {{ params.interval_s = {interval_s}f; }} }}"
    )


POLICIES = {
    "law": (MahalanobisInterval(), "auvest::MahalanobisInterval<float>"),
    "budget": (CovarianceBudget(), "auvest::CovarianceBudget<float>"),
    "20 ms": (FixedInterval(interval_s=0.02), fixed(0.02)),
    "0.5 s": (FixedInterval(interval_s=0.5), fixed(0.5)),
}


@pytest.fixture(scope="session")
def loops(build_loop):
    """Return a function that compiles the loop with settings, each kind once."""
    compiled = {}

    def loop(policy="law", **settings):
        settings["IntervalPolicy"] = POLICIES[policy][1]
        key = tuple(sorted(settings.items()))
        if key not in compiled:
            compiled[key] = build_loop(**settings).elf
        return compiled[key]

    return loop


def noisy_sonar(seed=1, delay_s=0.005):
    """Answer after a while, with noise of the size that the filter expects."""
    random = np.random.default_rng(seed)

    def sonar(sample, r, bearing):
        noise = random.normal(size=2) * (0.05, 0.01)
        return [(delay_s, telemetry.answer(sample, r + noise[0], bearing + noise[1]))]

    return sonar


def assert_same_bits(run, expected):
    """Every number of every line is the desk's; they are floats, so equality means equal bits."""
    for row, wanted in zip(run.rows, expected, strict=True):
        for name, value in wanted.items():
            assert np.float64(row[name]) == value or (row[name] != row[name] and value != value), (
                f"sample {row['sample']:.0f}, {name}: {row[name]!r} on the chip, {value!r} here"
            )


@pytest.mark.parametrize("policy", ["law", "budget"])
def test_sixty_samples_at_the_commanded_moments(play, loops, on_the_desk, policy):
    run = play(loops(policy, kCovarianceRows="6"), noisy_sonar())

    # The printed moments follow from the intervals that the desk computes; see on_the_desk.
    assert_same_bits(run, on_the_desk(run, POLICIES[policy][0]))
    assert run.measured.all()
    for counter in ("status", "missed", "refused", "late"):
        assert not run.column(counter).any(), counter

    commanded = np.concatenate([[0.0], np.cumsum(run.column("interval_s")[:-1])])
    error = np.abs(run.moments_s - commanded).max()
    print(f"{policy}: worst timing error {1e6 * error:.1f} us, awake {run.report.awake_share:.2%}")
    # Required: 1 ms. Each interval is rounded to 4 us, and the errors add up like a random walk.
    assert error < 1e-4
    assert np.abs(run.moments_s - (run.column("time_s") - 0.5)).max() < 1e-5
    # The clock starts behind the comment, and the first interval is 0.5 s.
    (introduced_s,) = (t for t, text in run.comments if text.startswith("$COLUMNS"))
    assert run.triggers_s[0] - introduced_s == pytest.approx(0.5, abs=2e-3)

    assert run.column("interval_s").min() >= 0.02
    assert run.column("interval_s").max() <= 1.0
    assert np.unique(run.column("interval_s")).size > 10, "the interval adapts"
    if policy == "budget":
        sigma = np.sqrt(run.column("P00_m2") + run.column("P11_m2"))
        assert sigma.max() < 0.1, "after an update the position is known better than the budget"
    assert run.report.serial_overruns == 0


def test_awake_share(play, loops):
    run = play(loops("law"), noisy_sonar())
    own = run.column("awake_us")[1:].sum() * 1e-6 / np.ptp(run.column("time_s"))
    print(f"awake: {run.report.awake_share:.2%} simulated, {own:.2%} by the board's own count")
    # 7 ms of filter, 2 ms of text and 180 characters at 5 us each, every 0.6 s; the board's own
    # count leaves out the interrupts that end a sleep.
    assert 0.01 < run.report.awake_share < 0.04
    assert 0.7 * run.report.awake_share < own < run.report.awake_share


def test_shortest_interval_keeps_its_moments(play, loops, on_the_desk):
    """20 ms are enough for the sonar, the filter and its line, which is sent meanwhile."""
    run = play(loops("20 ms"), noisy_sonar())
    assert_same_bits(run, on_the_desk(run, POLICIES["20 ms"][0]))
    assert run.measured.all()
    assert run.rows[-1]["late"] == 0
    assert np.abs(np.diff(run.moments_s) - 0.02).max() < 1e-4


def test_late_samples_are_counted_and_start_anew(play, loops, on_the_desk):
    """With all of P a line takes 30 ms: every deadline 20 ms ahead is missed, and said so."""
    run = play(loops("20 ms", kCovarianceRows="6"), noisy_sonar())
    # On the desk, the prediction covers what really passed: the same bits again.
    assert_same_bits(run, on_the_desk(run, POLICIES["20 ms"][0]))
    assert run.measured.all()
    spacing = np.diff(run.moments_s)
    assert run.rows[-1]["late"] > 50
    assert spacing.min() > 0.0195, "never sooner than commanded"
    assert spacing.max() < 0.04, "no later than one line"
    error = np.abs(spacing - run.column("dt_s")[1:])
    assert error.max() < 1e-3, "a deadline missed by less is kept to"
    late = np.diff(run.column("late"), prepend=0) > 0
    assert error[late[1:] & late[:-1]].max() < 1e-4, "what really passed"


def test_the_clock_wraps_unnoticed(play, build_loop, on_the_desk):
    """Ticks wrap after 4.8 hours; here the clock starts so that they do after 9 s."""
    start, clock = 0xFFDC, "wake_timer::overflows"
    edits = [
        (
            "tracking_loop.ino",
            "begin();\n  deadline",
            f"begin();\n  {clock} = {start};\n  deadline",
        ),
        ("tracking_loop.ino", "moment = 0;", f"moment = {start}ul << 16;"),
    ]
    run = play(build_loop(edits).elf, noisy_sonar(), samples=40)
    assert run.column("time_s")[-1] > 15
    assert_same_bits(run, on_the_desk(run, POLICIES["law"][0]))
    assert run.rows[-1]["late"] == 0
    assert np.abs(run.moments_s - (run.column("time_s") - 0.5)).max() < 1e-5


# ---- What a serial line and a sonar can do wrong -------------------------------------------------


# What comes instead of the answer: (delay in s, text); and how many lines the sketch then refuses.
# {whole} is the answer as it should be, {before} and {after} are those to the samples around it.
FAULTS = {
    "nothing": ([], 0),
    "wrong checksum": ([(0.005, "{body}*{wrong}")], 1),
    "checksum of no digits": ([(0.005, "{body}*zz")], 1),
    "changed character": ([(0.005, "{changed}")], 1),
    "no checksum": ([(0.005, "{body}")], 1),
    "half a line": ([(0.005, "{head}")], 1),
    "the other half": ([(0.005, "{tail}")], 1),
    "garbage": ([(0.005, "\xff\xfe\x00*$$*,,\x80%")], 3),
    "much garbage": ([(0.005, "\xaa" * 300)], 1),
    "empty lines": ([(0.005, ""), (0.006, "\r")], 0),
    "only a dollar": ([(0.005, "$")], 1),
    "other sentence": ([(0.005, telemetry.frame("GPGGA,123519,4807.038,N"))], 1),
    "sample before": ([(0.005, "{before}")], 1),
    "sample after": ([(0.005, "{after}")], 1),
    "no number": ([(0.005, "near,left")], 1),
    "one number": ([(0.005, "1.5")], 1),
    "empty number": ([(0.005, ",0.5")], 1),
    "three numbers": ([(0.005, "1.5,0.5,0.1")], 1),
    "not a number": ([(0.005, "nan,0.5")], 1),
    "infinite": ([(0.005, "1.5,inf")], 1),
    "an exponent": ([(0.005, "1.5e0,0.5")], 1),
    "ten digits": ([(0.005, "1.500000000,0.5")], 1),
    "two points lost": ([(0.005, "{pointless}")], 1),
    "old checksum": ([(0.005, "{body}*4f")], 1),
    "too late": ([(0.12, "{whole}")], 0),
    "over the time-out": ([(0.0975, "{whole}")], 0),
}
# The answer comes, although; and how many lines are refused before it.
RECOVERIES = {
    "second try": ([(0.005, "$SONAR,9"), (0.01, "{whole}")], 1),
    "begun twice": ([(0.005, "$SONAR,{whole}")], 1),
    "old one first": ([(0.005, "{before}"), (0.01, "{whole}")], 1),
    "just in time": ([(0.09, "{whole}")], 0),
    "twice": ([(0.005, "{whole}"), (0.005, "{whole}")], 0),
    "negative range": ([(0.005, "-0.01,0.5")], 0),
}


def disturbed(text, sample, r, bearing):
    """Fill in the answer, whole or in parts; bare numbers become an answer to this sample."""
    if text[:1] in set("-,0123456789ni") or text == "near,left":
        return telemetry.frame(f"SONAR,{sample},{text}")
    whole = telemetry.answer(sample, r, bearing)
    body, _, checksum = whole.partition("*")
    return text.format(
        whole=whole,
        body=body,
        wrong=f"{int(checksum, 16) ^ 0x10:08x}",
        changed=whole.replace(".", ":", 1),
        pointless=whole.replace(".", ""),
        head=whole[:12],
        tail=whole[12:],
        before=telemetry.answer(sample - 1, r, bearing),
        after=telemetry.answer(sample + 1, r, bearing),
    )


@pytest.mark.parametrize("policy", ["law", "budget"])
def test_faults_cost_one_measurement_and_nothing_else(play, loops, on_the_desk, policy):
    """Each fault meets one sample; a sound answer follows at the next."""
    cases = [*FAULTS.items(), *RECOVERIES.items()]
    at = {3 + 2 * i: case for i, case in enumerate(cases)}
    sound = noisy_sonar()

    def sonar(sample, r, bearing):
        if sample not in at:
            return sound(sample, r, bearing)
        _, (messages, _) = at[sample]
        return [(delay_s, disturbed(text, sample, r, bearing)) for delay_s, text in messages]

    run = play(loops(policy), sonar, samples=4 + 2 * len(cases))

    assert_same_bits(run, on_the_desk(run, POLICIES[policy][0]))
    refused, missed = run.column("refused"), run.column("missed")
    for sample, (name, (_, lines)) in at.items():
        i = sample - 1
        good = name in RECOVERIES
        assert run.measured[i] == good, name
        assert missed[i] - missed[i - 1] == (not good), name
        assert refused[i] - refused[i - 1] == lines, name
    # What came too late is not held against the sample after it.
    assert refused[-1] == sum(lines for _, lines in dict(cases).values())
    healthy = [k for k in range(1, len(run.rows) + 1) if k not in at]
    assert run.measured[np.array(healthy) - 1].all(), "the sample after a fault is sound"
    # The budget wants the next sample 20 ms after one that it waited 100 ms for in vain.
    late = np.flatnonzero(np.diff(run.column("late"), prepend=0))
    assert not run.measured[late - 1].any(), "late only behind a missed answer"
    assert policy == "budget" or late.size == 0
    assert run.report.serial_overruns == 0


def test_answers_under_way_when_the_next_sample_is_due(play, loops, on_the_desk):
    """The end of a stale answer comes behind the next trigger: refused, and the right one taken."""
    sound = noisy_sonar()

    def sonar(sample, r, bearing):
        # The request ends 1 ms after the trigger; the answer takes 2.6 ms on the line.
        late = [(0.498, telemetry.answer(sample, r, bearing))]
        return late if sample % 2 else sound(sample, r, bearing)

    run = play(loops("0.5 s"), sonar, samples=20)
    assert_same_bits(run, on_the_desk(run, POLICIES["0.5 s"][0]))
    assert run.measured.tolist() == 10 * [False, True]
    assert run.column("refused").tolist() == [k // 2 for k in range(1, 21)]
    assert run.rows[-1]["late"] == 0
    assert np.abs(np.diff(run.moments_s) - 0.5).max() < 1e-4


def test_silence_and_back(play, loops, on_the_desk):
    """Without a sonar the estimate drifts, honestly; the first answers bring it back."""
    sound = noisy_sonar()

    def sonar(sample, r, bearing):
        return sound(sample, r, bearing) if not 10 <= sample < 50 else []

    run = play(loops("law"), sonar, samples=60)
    assert_same_bits(run, on_the_desk(run, POLICIES["law"][0]))
    sigma = np.sqrt(run.column("P00_m2") + run.column("P11_m2"))
    assert run.rows[-1]["missed"] == 40
    assert sigma[48] > 10 * sigma[8], "it knows that it does not know"
    assert sigma[59] < 0.3 * sigma[48]


def test_missing_answers_at_the_shortest_interval(play, loops, on_the_desk):
    """Waiting for an answer takes 0.1 s: the samples after it are late, and counted."""
    sound = noisy_sonar()

    def sonar(sample, r, bearing):
        return sound(sample, r, bearing) if sample % 4 else []

    run = play(loops("20 ms"), sonar)
    assert_same_bits(run, on_the_desk(run, POLICIES["20 ms"][0]))
    assert run.rows[-1]["missed"] == 15
    after = np.arange(4, 60, 4)
    assert (np.diff(run.column("late"))[after - 1] == 1).all(), "the sample after each is late"
    assert np.diff(run.moments_s)[after - 1] == pytest.approx(0.105, abs=0.005)


def test_a_range_that_sound_cannot_reach_is_refused_by_the_filter(play, loops, on_the_desk):
    """A whole answer that cannot be true: a status, and the prediction stays."""
    sound = noisy_sonar()
    impossible = {5: "75.1", 7: "999999999"}  # kLargestRange is 75 m

    def sonar(sample, r, bearing):
        if sample in impossible:
            return [(0.005, telemetry.frame(f"SONAR,{sample},{impossible[sample]},0.5"))]
        return sound(sample, r, bearing)

    run = play(loops("law"), sonar, samples=10)
    assert run.measured.all()
    assert_same_bits(run, on_the_desk(run, POLICIES["law"][0]))
    refused = run.column("status") == int(Status.impossible_range)
    assert np.flatnonzero(refused).tolist() == [4, 6]
    assert not run.column("status")[~refused].any()


def test_what_cannot_be_is_implausible_and_not_taken(play, loops, on_the_desk):
    """A jump, a bearing that is none, two beyond the gate: named, predicted only."""
    sound = noisy_sonar()
    wrong = {20: (15.0, 0.0), 24: (0.0, 7.0), 28: (1.5, 0.0), 32: (0.0, 0.5)}

    def sonar(sample, r, bearing):
        more = wrong.get(sample, (0.0, 0.0))
        if sample in wrong:
            return [(0.005, telemetry.answer(sample, r + more[0], bearing + more[1]))]
        return sound(sample, r, bearing)

    run = play(loops("law"), sonar, samples=36)
    assert_same_bits(run, on_the_desk(run, POLICIES["law"][0]))
    implausible = run.column("status") == IMPLAUSIBLE
    assert [k + 1 for k in np.flatnonzero(implausible)] == list(wrong)
    nis = run.column("nis")[implausible]
    assert np.isnan(nis[:2]).all(), "the limits come first"
    assert (nis[2:] > 13.8).all(), "the gate says by how much"


def test_an_estimate_that_is_wrong_is_found_again(play, loops):
    """A gate alone is a trap: after five refusals in a row the belief is widened, and follows."""
    sound = noisy_sonar()

    def sonar(sample, r, bearing):
        return sound(sample, r + (1.8 if sample > 15 else 0.0), bearing)

    run = play(loops("0.5 s"), sonar, samples=40)
    refused = run.column("status") == IMPLAUSIBLE
    assert refused[15:20].all(), "the fifth in a row, and the estimate is still believed"
    assert not refused[23:].any()
    assert not refused[:15].any()
    # Where the sonar says that it is.
    seen = run.column("range_m"), run.column("bearing_rad")
    away = np.hypot(run.column("x_m") - 0.2, run.column("y_m") - 2.0)
    assert np.abs(away - seen[0])[30:].max() < 0.3


# ---- Text, memory, the command -------------------------------------------------------------------


def test_decimal_text(play, loops):
    """For the Serial Monitor: the same numbers to six decimals."""
    exact = play(loops("law"), noisy_sonar(), samples=20)
    text = play(loops("law", kExactText="false"), noisy_sonar(), samples=20)
    for name in exact.rows[0]:
        if name != "awake_us":
            np.testing.assert_allclose(text.column(name), exact.column(name), atol=6e-7, rtol=3e-7)


def test_remark_on_ram_is_the_simulators_count(play, loops):
    run = play(loops("law"), noisy_sonar(), samples=61)
    (remark,) = (text for _, text in run.comments if "RAM" in text)
    assert int(re.search(r"\d+", remark)[0]) == run.report.free_bytes


def test_capture_of_what_is_no_sketch(runner, tmp_path, monkeypatch):
    monkeypatch.setenv("AUVEST_BOARD", str(runner))
    call = ["capture", "--simulator", __file__, "--output", str(tmp_path)]
    result = CliRunner().invoke(app, call)
    assert result.exit_code == 1
    assert "not an ELF file" in result.stderr
    assert not list(tmp_path.iterdir())


def test_capture_command(loops, runner, tmp_path, monkeypatch):
    """A new user's first command, with the real sketch and the real simulator."""
    monkeypatch.setenv("AUVEST_BOARD", str(runner))
    call = ["capture", "--simulator", str(loops("law")), "--output", str(tmp_path), "--json"]
    result = CliRunner().invoke(app, [*call, "--dropout", "0.1"])
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    values = document["results"]
    assert values["samples"] == 60
    assert 0 < values["missed"] < 20
    assert values["worst_timing_error_s"] < 1e-3
    assert 0.01 < values["awake_share_simulated"] < 0.04
    # The range is measured to 0.05 m and the bearing to 0.01 rad at up to 25 m.
    assert values["rmse_m"] < 0.2
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    rows = (tmp_path / "record.csv").read_text().splitlines()
    assert len(rows) == 61
    assert rows[0].startswith("section,sample,time_s,dt_s,range_m,bearing_rad,")
    assert rows[0].endswith(",true_x_m,true_y_m")
