"""Ctrl-C during run(), slices of a record, and a fork while another thread is in run()."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from auvest import (
    Aukf,
    ConstantAcceleration,
    FunctionProcess,
    Position,
    RangeBearing,
    Slatf,
    Ukf,
    _interrupts,
)
from auvest.errors import Interrupted

P0 = np.diag([1, 1, 0.1, 0.1, 0.01, 0.01])


def tracker(kind: type = Ukf, **options: Any) -> Any:
    models = {"process": ConstantAcceleration(), "sensors": RangeBearing()} if kind is Ukf else {}
    return kind(np.ones(6), P0, **models, **options)


def record(rows: int) -> np.ndarray[Any, Any]:
    random = np.random.default_rng(0)
    return np.column_stack([random.normal(5, 0.1, rows), random.normal(0.2, 0.05, rows)])


def slave(particles: int = 16) -> Slatf:
    made = Slatf([0, 0], np.eye(2), particles=particles, dtype="float32", seed=3)
    made.add_master([100, 50, 1, 0, 0, 0], P0)
    return made


def run_slave(filter_: Slatf, rows: int) -> Any:
    """Readings each second; echoes at the start, at their ends, twice at one time, and between."""
    at = np.sort(np.concatenate([np.arange(0.0, rows + 1, 3), np.arange(0.5, rows, 7), [6.0]]))
    at = at[np.append(True, np.diff(at) > 0)]
    echoes = np.tile([110.0, 3.6], (len(at), 1))
    return filter_.run(np.arange(rows + 1.0), np.tile([1.0, 0.1], (rows, 1)), z=echoes, z_time_s=at)


def inside(filter_: Any) -> bool:
    """Whether run() is at work, past its look at the arguments."""
    if isinstance(filter_, Ukf):
        return "_run" in vars(filter_)
    return bool(filter_._exclusive._lock.locked())


@pytest.mark.parametrize("first_rows", [1, 7, 64])
@pytest.mark.parametrize(
    "run",
    [
        lambda: tracker().run(record(200), dt=0.1),
        lambda: tracker(late_s=1.0).run(record(200), dt=0.1, age_s=0.25),
        lambda: tracker(Aukf).run(record(200)),
        lambda: run_slave(slave(), 200),
    ],
    ids=["ukf", "late", "aukf", "slatf"],
)
def test_slices_do_not_change_a_bit(
    run: Callable[[], Any], first_rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = run()  # of one slice
    monkeypatch.setattr(_interrupts, "_ROWS", first_rows)
    monkeypatch.setattr(_interrupts, "_SLICE_S", 0.0)  # so that each has one row from there on
    sliced = run()
    assert len(whole) == 200
    for name in whole.columns:
        assert sliced[name].tobytes() == whole[name].tobytes(), name


def test_an_echo_at_the_very_beginning_is_heard() -> None:
    """It belongs to no reading that is over; it is an update before the first."""
    moves = np.arange(4.0), np.tile([1.0, 0.1], (3, 1))
    at_once = slave().run(*moves, z=[[110.0, 3.6], [111.0, 3.6]], z_time_s=[0.0, 2.0])
    before = slave()
    before.update([110.0, 3.6])
    assert before.log_likelihood != 0.0
    after = before.run(*moves, z=[[111.0, 3.6]], z_time_s=[2.0])
    for name in after.columns:
        assert after[name].tobytes() == at_once[name].tobytes(), name


@pytest.mark.usefixtures("ctrl_c")
@pytest.mark.parametrize(
    ("filter_", "run"),
    [
        (tracker(), lambda f: f.run(np.tile([5.0, 0.2], (2_000_000, 1)), dt=0.1, covariance=False)),
        (slave(100_000), lambda f: run_slave(f, 1500)),
    ],
    ids=["ukf", "slatf"],
)
def test_ctrl_c_keeps_the_rows_and_the_filter_at_the_last(
    filter_: Any, run: Callable[[Any], Any]
) -> None:
    sent = []

    def interrupt() -> None:
        while not inside(filter_):
            time.sleep(0.001)
        time.sleep(0.05)
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt) as stopped:
        run(filter_)
    late_s = time.monotonic() - sent[0]
    assert isinstance(stopped.value, Interrupted)
    rows: Any = stopped.value.partial
    assert 0 < len(rows) < 1_999_000
    assert np.array_equal(rows.x[-1], filter_.x)
    # Half a second on a machine of its own; slices are planned to a tenth of it.
    assert late_s < 3.0
    filter_.predict(0.1) if isinstance(filter_, Ukf) else filter_.predict(0.1, [1, 0])


@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_does_not_wait_for_functions_of_python() -> None:
    calls = []

    def move(x: Any, dt: float) -> Any:
        calls.append(dt)
        if len(calls) == 100:
            os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1e-4)
        return x

    process = FunctionProcess(move, np.eye(2), state=("x_m", "y_m"))
    filter_ = Ukf([0, 0], np.eye(2), process=process, sensors=Position())
    with pytest.raises(KeyboardInterrupt) as stopped:
        filter_.run(np.zeros((100_000, 2)), dt=0.1)
    assert 0 < len(stopped.value.partial) < 2000  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("filter_", "run"),
    [
        (tracker(), lambda f: f.run(np.tile([5.0, 0.2], (300_000, 1)), dt=0.1, covariance=False)),
        (slave(20_000), lambda f: run_slave(f, 100)),
    ],
    ids=["ukf", "slatf"],
)
def test_a_fork_during_run_says_why_the_filter_is_lost(
    filter_: Any, run: Callable[[Any], Any]
) -> None:
    thread = threading.Thread(target=run, args=(filter_,))
    thread.start()
    while not inside(filter_):
        assert thread.is_alive()
    with pytest.raises(RuntimeError, match="in use by another thread"):
        filter_.x  # noqa: B018
    heard, tell = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            filter_.x  # noqa: B018
            os.write(tell, b"read")
        except BaseException as error:
            os.write(tell, str(error).encode())
        finally:
            os._exit(0)
    os.waitpid(child, 0)
    thread.join()
    assert os.read(heard, 1000).startswith(b"this process was forked while another thread was usi")
    filter_.x  # noqa: B018  (of the parent it is free again)
