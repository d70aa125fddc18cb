"""Mutated saved states: refused, or a filter that is sound and can go on.

    python -m tests.attacks.states --states 200000 --seed 1

Half of the mutations come with a new checksum, as from a program that writes states wrongly. What
loads has a finite estimate, a covariance, an interval and a tau within their limits, and takes the
next steps, unless a filter that starts there refuses them too.
"""

from __future__ import annotations

import copy
import json
import math
import random
import struct
import warnings
import zlib
from collections import Counter
from collections.abc import Callable
from functools import cache
from typing import Any, ClassVar

import numpy as np

import auvest
from tests.attacks.frame import Case, Failed, main
from tests.attacks.interface import require_sound, state_of
from tests.python.family_support import BUILT_IN, KINDS, record, sensors_for, start

#: In the place of a number of the state.
ODD = (math.nan, math.inf, -math.inf, -1.0, 0.0, 1e300, 1e-300, 1e38, 1e-38, -1e38, 1e9, 2.0, 0.5)
ODD_WHOLE = (0, -1, 1, 2, 3, 7, 255, 256, 2**31, -(2**31), 2**62, -(2**62))
#: In the place of something in the header.
ODD_JSON = (None, True, -1, 0, 1e300, 2**70, "x", [], {}, "float32", [1, 2], "Ekf")

_MASTER = ([0, 300, 5, 1.3, 0, 0], np.diag([1, 1, 0.0025, 0.0025, 1e-8, 1e-8]))
_SLAT: dict[str, Callable[..., Any]] = {
    "Slatf, version 1": lambda x, p, d: auvest.Slatf(
        x, p, version=1, particles=9, gate=16, resample_below=0.9, dtype=d
    ),
    "Slatf, births": lambda x, p, d: auvest.Slatf(
        x, p, particles=9, gate=16, birth_velocity_m_s=2, dtype=d
    ),
    "Slatf, Imm": lambda x, p, d: auvest.Slatf(x, p, particles=5, master=auvest.Imm(), dtype=d),
    "SlatfJoint": lambda x, p, d: auvest.SlatfJoint(x, p, particles=9, max_masters=2, dtype=d),
    "EkfSlat": lambda x, p, d: auvest.EkfSlat(x, p, gate=16, dtype=d),
    "EkfSlat, Imm": lambda x, p, d: auvest.EkfSlat(x, p, master=auvest.Imm(), dtype=d),
    "DeadReckoning": lambda x, p, d: auvest.DeadReckoning(x, p, dtype=d),
}
_POLICIES = {
    "Mahalanobis": auvest.MahalanobisInterval("table1", tau0=0.3),
    "budget": auvest.CovarianceBudget(position_sigma_m=0.2),
    "fixed": auvest.FixedInterval(),
}


def drive(f: Any, rows: range) -> None:
    """Take these rows of a record; a row takes measurements that fit the filter."""
    if isinstance(f, auvest.filters.GaussianFilter):
        whole = record(f.process)
        for k in rows:
            whole.step(f, k)
        return
    for k in rows:
        f.predict(0.5, [4, 0.2])
        if f._births:
            f.update([300 + k, -1.6], auvest.UNKNOWN_MASTER)
        elif f._core_steps.masters > 0:
            f.update([300 + k, -1.6], 0)


@cache
def subjects() -> dict[str, Any]:
    """Filters in the midst of their work."""
    found: dict[str, Any] = {}
    for dtype in ("float32", "float64"):
        for kind in KINDS:
            for name, process in BUILT_IN.items():
                options: dict[str, Any] = {"process": process, "sensors": sensors_for(process)}
                found[f"{kind.__name__} of {name}, {dtype}"] = kind(
                    *start(process), dtype=dtype, **options
                )
            process = BUILT_IN["SpeedHeading"]
            found[f"{kind.__name__} of an unknown start, {dtype}"] = kind(
                *start(process),
                process=process,
                sensors=sensors_for(process),
                kernel="igg",
                recovery=auvest.RejectionStreak(),
                components=8,
                dtype=dtype,
            )
            process = BUILT_IN["SpeedHeadingBias"]
            for policy, chosen in _POLICIES.items():
                late = kind(
                    *start(process),
                    process=process,
                    sensors=sensors_for(process),
                    kernel="igg",
                    recovery=auvest.RejectionStreak(),
                    policy=chosen,
                    late_s=3.0,
                    dtype=dtype,
                )
                found[f"{kind.__name__}, late, {policy}, {dtype}"] = late
        for name, make in _SLAT.items():
            slat = make([0, 0], 0.01 * np.eye(2), dtype)
            outage = auvest.Outage(slat)
            outage.share([0, 0], 0.01 * np.eye(2), [_MASTER])
            if name not in ("DeadReckoning", "Slatf, births"):
                slat.add_master(*_MASTER)
            found |= {f"{name}, {dtype}": slat, f"Outage of {name}, {dtype}": outage}
    for f in found.values():
        drive(f, range(6))
    return found


# ---- The format, as auvest._state says it.

_PREFIX = struct.Struct("<8sIQI")


def opened(state: bytes) -> tuple[dict[str, Any], bytearray]:
    _, _, _, size = _PREFIX.unpack_from(state)
    body = state[_PREFIX.size : -4]
    return json.loads(body[:size]), bytearray(body[size:])


def closed(header: dict[str, Any], payload: bytes) -> bytes:
    text = json.dumps(header).encode()
    length = _PREFIX.size + len(text) + len(payload) + 4
    state = _PREFIX.pack(b"auvest\r\n", 1, length, len(text)) + text + payload
    return state + struct.pack("<I", zlib.crc32(state))


def mutated(state: bytes, step: tuple[Any, ...]) -> bytes:
    """Apply one mutation; those of places that are not there change nothing."""
    what, where, value = step
    if what == "bit":
        raw = bytearray(state)
        at = where % (8 * max(1, len(raw)))
        if raw:
            raw[at // 8] ^= 1 << at % 8
        return bytes(raw)
    if what == "cut":
        return state[: where % (len(state) + 1)]
    if what == "insert":
        at = where % (len(state) + 1)
        return state[:at] + bytes([value % 256]) + state[at:]
    try:
        header, payload = opened(state)
        if what == "number":
            change_number(header, payload, where, value)
        elif what == "header":
            change_header(header, where, value)
        elif what == "payload" and payload:
            at = where % (8 * len(payload))
            payload[at // 8] ^= 1 << at % 8
    except (ValueError, TypeError, LookupError, ArithmeticError, struct.error):
        return state  # a mutation before this one has broken the form
    return closed(header, bytes(payload))


def change_number(header: dict[str, Any], payload: bytearray, where: int, value: int) -> None:
    """Replace one element of one array; every array is as likely, however long it is."""
    table = [(d, math.prod(s)) for _, d, s in header["arrays"]]
    sizes = [np.dtype(d).itemsize * count for d, count in table]
    chosen = where % len(table)
    dtype, count = table[chosen]
    if count == 0:
        return
    at = sum(sizes[:chosen]) + where // len(table) % count * np.dtype(dtype).itemsize
    odd = ODD if np.dtype(dtype).kind == "f" else ODD_WHOLE
    with np.errstate(all="ignore"):
        number = np.array(odd[value % len(odd)]).astype(dtype)
    payload[at : at + number.itemsize] = number.tobytes()


def change_header(header: dict[str, Any], where: int, value: int) -> None:
    """Replace something in the header, however deep."""
    place: Any = header
    while True:
        keys = list(place) if isinstance(place, dict) else range(len(place))
        key = keys[where % len(keys)]
        where //= len(keys)
        inner = place[key]
        if not isinstance(inner, (dict, list)) or not inner or where % 5 == 0:
            place[key] = ODD_JSON[value % len(ODD_JSON)]
            return
        place = inner


class States:
    """The attack."""

    unit: ClassVar[str] = "states"

    def case(self, rng: random.Random) -> Case:
        subject = rng.choice(list(subjects()))
        plain = ("bit", "bit", "cut", "insert")
        renewed = ("number", "number", "number", "payload", "header")
        kinds = renewed if rng.random() < 0.5 else plain
        steps = [
            (rng.choice(kinds), rng.randrange(2**40), rng.randrange(2**10))
            for _ in range(rng.choice((1, 1, 1, 2, 3)))
        ]
        return Case(subject, tuple(steps))

    def text(self, case: Case) -> str:
        return (
            "from tests.attacks.states import mutated, subjects\n"
            f"f = subjects()[{case.subject!r}]\n"
            "state = f.save()\n"
            f"for step in {case.steps!r}:\n    state = mutated(state, step)\n"
            "f.restore(state)"
        )

    def run(self, case: Case, counts: Counter[str]) -> None:
        f = copy.deepcopy(subjects()[case.subject])
        state, name = f.save(), type(f).__name__
        for step in case.steps:
            state = mutated(state, step)
        counts["states"] += 1
        renewed = case.steps and case.steps[0][0] in ("number", "payload", "header")
        counts["with a new checksum"] += bool(renewed)
        before = state_of(f)
        try:
            f.restore(state)
        except (ValueError, TypeError):
            counts["refused"] += 1
            if state_of(f) != before:
                raise Failed(f"{name}: changed by a state it refused", "") from None
            return
        except BaseException as wrong:
            kind = f"{name}.restore(): {type(wrong).__name__}"
            raise Failed(kind, repr(wrong)) from None
        counts["loaded"] += 1
        require_sound(f)
        require_limits(f)
        self._go_on(f, counts)

    def _go_on(self, f: Any, counts: Counter[str]) -> None:
        name, there = type(f).__name__, copy.deepcopy(f)
        try:
            drive(f, range(6, 9))
        except auvest.FilterError as refused:
            counts["loaded, next steps refused"] += 1
            if not refused_from_start(there, refused.status):
                kind = f"{name}: takes no step after a state that it took: {refused.status.name}"
                raise Failed(kind, str(refused)) from None
            return
        except BaseException as wrong:
            kind = f"{name} after a state: {type(wrong).__name__}"
            raise Failed(kind, repr(wrong)) from None
        require_sound(f)
        require_limits(f)


def require_limits(f: Any) -> None:
    """Raise where the interval or the memory of its law is out of range."""
    policy = getattr(f, "policy", None)
    if policy is None:
        return
    name, slack = f"{type(f).__name__} with {type(policy).__name__}", 1e-6
    low, high = getattr(policy, "min_s", 0.0), getattr(policy, "max_s", math.inf)
    if not low * (1 - slack) <= f.interval <= high * (1 + slack):
        raise Failed(f"{name}: interval out of its limits", f"{f.interval}, limits {low}, {high}")
    if isinstance(policy, auvest.FixedInterval) and f.interval != f.dtype.type(policy.interval_s):
        raise Failed(f"{name}: interval is not the fixed one", f"{f.interval}")
    if isinstance(policy, auvest.MahalanobisInterval):
        if not policy.tau_min * (1 - slack) <= f.tau <= policy.tau_max * (1 + slack):
            raise Failed(f"{name}: tau out of its limits", f"{f.tau}")
        if not (math.isfinite(f.ratio) and math.isfinite(f.mahalanobis_squared)):
            raise Failed(f"{name}: law not finite", f"{f.ratio}, {f.mahalanobis_squared}")


def refused_from_start(f: Any, status: auvest.Status) -> bool:
    """Whether a filter that starts where this one is refuses the next steps as well."""
    if isinstance(f, auvest.filters.GaussianFilter):
        fresh = copy.deepcopy(f)
        try:
            fresh.__init__(  # type: ignore[misc]
                f.x, f.P, process=f.process, sensors=f.sensors, dtype=f.dtype, policy=f.policy,
                kernel=f.kernel, recovery=f.recovery, late_s=f.late_s,
            )  # fmt: skip
            drive(fresh, range(6, 9))
        except auvest.FilterError:
            return True
        except ValueError:  # no filter may start there
            return status == auvest.Status.far_from_origin
        return False
    # Masters and particles beyond the range of the numbers say so.
    beyond = ("overflow", "not_finite", "far_from_origin")
    return status.name in beyond


ATTACK = States()

if __name__ == "__main__":
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        main(ATTACK, __doc__, 10_000)
