"""The same records give the same bits on every target; and what would break that is noticed.

The reference is Python: what a user validates on the desk. NaN is compared by its bits as well: a
filter never keeps one, and where a measurement is missing the trace has the one NaN of the library.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from auvest import SelfTestPart, Status
from auvest.firmware.hil import ulps
from firmware import chips
from firmware.chips import CHIPS
from firmware.parity import golden
from firmware.parity.targets import CHIP_TARGETS, TARGETS
from tests.parity.comparison import (
    asked_for,
    differing_bits,
    first_difference,
    target_params,
)
from tests.parity.records import REFERENCED, SELF_TEST, TRACE, all_records, bytes_of, trace_of
from tests.slow import SLOW

CONTROLS = Path(__file__).parent / "controls"
RECORDS = all_records()
BY_NAME = {record.name: record for record in RECORDS}
TARGET = {target.name: target for target in TARGETS}
#: Of the chips of QEMU the one that is always replayed, and its record.
SHORT = ("riscv32imc", "gaps")

#: avr-libc's own division rounds subnormal quotients down; this record lives of them.
SUBNORMAL_QUOTIENTS = "subnormal-quotients"


def pairs():
    """Every record on every target; the long one, a billion cycles, on one ATmega2560 only."""
    for target in TARGETS:
        for record in RECORDS:
            if (record.name, target.name) == ("long", "atmega2560-O2"):
                continue
            if (record.name, target.name) == (SUBNORMAL_QUOTIENTS, "atmega2560-O2"):
                continue  # its own test, below
            marks = () if asked_for(target) else SLOW
            yield pytest.param(record, target, id=f"{target.name}-{record.name}", marks=marks)
    for target in CHIP_TARGETS:
        for record in RECORDS:
            marks = () if (target.name, record.name) == SHORT or asked_for(target) else SLOW
            yield pytest.param(record, target, id=f"{target.name}-{record.name}", marks=marks)


@pytest.mark.parametrize(("record", "target"), list(pairs()))
def test_every_target_gives_the_bits_of_python(record, target, replay, expected):
    found = trace_of(replay(target, record.to_bytes()), record)
    wanted = expected(record)
    difference = first_difference(wanted, found)
    assert difference is None, (
        f"{record.name} on {target.name}: {differing_bits(wanted, found)} bits differ; {difference}"
    )


@SLOW
def test_the_one_known_disagreement_is_still_there(replay, expected):
    """Without the library's float routines, equal bits exclude quotients below 1.2e-38.

    When this fails, avr-libc has been mended: give the record to all targets.
    """
    record = BY_NAME[SUBNORMAL_QUOTIENTS]
    found = trace_of(replay(TARGET["atmega2560-O2"], record.to_bytes()), record)
    assert first_difference(expected(record), found) is not None


@pytest.mark.parametrize("target", target_params(TARGETS))
def test_the_self_test_passes_on_every_target(target, replay):
    assert self_test_of(replay(target, SELF_TEST)) == (SelfTestPart.none, 0)


#: The self-test alone, a small program; its golden trace is a record of the AUKF.
SELF_TEST_ALONE = """
#include "auvest/self_test.hpp"
#include "board.hpp"

int main() {
  const auvest::SelfTestResult result = auvest::self_test();
  board::write(static_cast<std::uint8_t>(result.failed));
  board::write(result.index);
  board::finish();
}
"""


@pytest.mark.parametrize("name", [target.name for target in CHIP_TARGETS])
def test_the_self_test_passes_on_every_chip(name, tmp_path):
    source = tmp_path / "self_test.cpp"
    source.write_text(SELF_TEST_ALONE, encoding="utf-8")
    program = chips.build(CHIPS[name], [source], tmp_path / "self_test.elf")
    assert chips.run(CHIPS[name], program, b"", tmp_path).trace == bytes([SelfTestPart.none, 0])


def test_the_self_test_notices_fused_products_on_a_cortex_m7(tmp_path):
    """As a core of Arduino compiles that does not pass -ffp-contract=off."""
    source = tmp_path / "self_test.cpp"
    source.write_text(SELF_TEST_ALONE, encoding="utf-8")
    flags = (*chips.SKETCH_FLAGS, "-ffp-contract=fast")
    program = chips.build(CHIPS["cortex-m7"], [source], tmp_path / "self_test.elf", flags)
    failed, _ = chips.run(CHIPS["cortex-m7"], program, b"", tmp_path).trace
    assert SelfTestPart(failed) == SelfTestPart.contraction


def self_test_of(trace):
    failed, index = np.frombuffer(trace, "<u4")
    return SelfTestPart(int(failed)), int(index)


def test_the_golden_values_are_those_of_the_headers():
    header = golden.HEADER.read_text(encoding="utf-8")
    assert golden.with_values(header, *golden.golden_values()) == header, (
        "if the arithmetic was meant to change: python -m firmware.parity.golden"
    )


# ---- Negative controls: builds that do not keep the bits -----------------------------------------

LIBM = f"-I{CONTROLS / 'libm'}"
FUSED = ("-ffp-contract=fast", "-mfma")
GCC, CLANG = "gcc-O3-march=native", "clang-O3-march=native"

# What is done to which target, and the part of the self-test that must notice. The preprocessor
# does not see these, so config.hpp cannot refuse them.
BROKEN = {
    "libm on the host": (GCC, SelfTestPart.math, LIBM),
    "libm of avr-libc": ("atmega2560-ide", SelfTestPart.math, LIBM),
    "libm of newlib": ("cortex-m4f", SelfTestPart.math, LIBM),
    "fused by gcc": (GCC, SelfTestPart.contraction, *FUSED),
    "fused by clang": (CLANG, SelfTestPart.contraction, *FUSED),
    "fused on Cortex-M4F": ("cortex-m4f", SelfTestPart.contraction, "-ffp-contract=fast"),
    "rounding upward": ("gcc-O0", SelfTestPart.rounding, CONTROLS / "round_upward.cpp"),
    "flushed on the host": (GCC, SelfTestPart.subnormals, CONTROLS / "flush_subnormals.cpp"),
    "flushed on Cortex-M4F": (
        *("cortex-m4f", SelfTestPart.subnormals, CONTROLS / "flush_subnormals.cpp"),
    ),
    "x87": (GCC, SelfTestPart.expression, "-mfpmath=387", f"-I{CONTROLS / 'x87'}"),
    "reordered by clang": (CLANG, SelfTestPart.expression, "-funsafe-math-optimizations"),
    "reordered by avr-gcc": (
        *("atmega2560-O2", SelfTestPart.expression, "-funsafe-math-optimizations"),
    ),
    "reordered in WebAssembly": (
        *("wasm32", SelfTestPart.expression, "-funsafe-math-optimizations"),
    ),
    "libm of wasi-libc": ("wasm32", SelfTestPart.math, LIBM),
    "without NaN by clang": (CLANG, SelfTestPart.expression, "-fno-honor-nans"),
    "without signs of zeros": (GCC, SelfTestPart.expression, "-fno-signed-zeros"),
}


#: One for each part of the self-test, on what is replayed anyway; the others take a build each.
ALWAYS = {
    *("libm of avr-libc", "fused on Cortex-M4F", "rounding upward", "flushed on Cortex-M4F"),
    "reordered by clang",
}


@pytest.mark.parametrize(
    "broken", [pytest.param(name, marks=() if name in ALWAYS else SLOW) for name in BROKEN]
)
def test_what_breaks_the_bits_is_noticed(broken, replay, expected):
    name, part, *extra = BROKEN[broken]
    extra.append("-DAUVEST_WITHOUT_ROBUST")  # half of the compiler's time, and none of the records
    failed, _ = self_test_of(replay(TARGET[name], SELF_TEST, *extra))
    assert failed == part
    shows = (
        record.name
        for record in RECORDS
        if replay(TARGET[name], record.to_bytes(), *extra) != bytes_of(expected(record))
    )
    assert next(shows, None) is not None, "no record shows it"


# ---- The records do what they are for ------------------------------------------------------------


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: record.name)
def test_refused_calls_leave_the_bits(record, expected):
    trace = expected(record)
    for before, after, step in zip(trace[:-1], trace[1:], record.steps[1:], strict=True):
        untouched = after["predict"] and (after["update"] or _is_missing(after))
        if untouched:
            assert np.array_equal(before["x"], after["x"])
            assert np.array_equal(before["P"], after["P"])
        if after["feedback"] or not step["flags"] & REFERENCED:
            assert before["interval"] == after["interval"]


def _is_missing(row):
    return row["nis"] == 0x7FC00000


def test_the_records_reach_every_status_and_the_corners(expected):
    traces = {record.name: expected(record) for record in RECORDS}
    reached = {name: set(np.unique(t["predict"])) for name, t in traces.items()}
    predict = set().union(*reached.values())
    update = {int(s) for t in traces.values() for s in np.unique(t["update"])}
    feedback = {int(s) for t in traces.values() for s in np.unique(t["feedback"])}
    ok, not_finite = int(Status.ok), int(Status.not_finite)
    refused = {not_finite, int(Status.time_backwards), int(Status.overflow)}
    assert predict == {ok, int(Status.far_from_origin)} | refused
    assert update >= {ok, not_finite, int(Status.overflow)}
    assert feedback == {ok, not_finite}
    for name in ("paper-normal", "near-ukf-exact-0", "station-aukf", "long"):
        near = traces[name]["near_field"]
        assert 0 < near.sum() < len(near), f"{name} must be near the station and away from it"
    for name in ("dying-ekf", "scale-ukf-1e-17", "intervals-aukf-exact"):
        bits = traces[name]["P"] & 0x7FFFFFFF
        assert ((bits > 0) & (bits < 0x00800000)).any(), f"{name} must have subnormal numbers"
    assert _is_missing(traces["gaps"]).any()
    refused = traces["refusals-ukf"]
    assert ((refused["predict"] > 0) & (refused["update"] > 0)).any()
    assert ((refused["predict"] > 0) & _is_missing(refused)).any()
    assert len(set(traces["paper-normal"]["interval"])) > 20, "the interval must adapt"


# ---- The comparison itself -----------------------------------------------------------------------


def test_a_difference_names_step_field_values_and_distance():
    a = np.zeros(3, TRACE)
    a["x"] = 0x3F800000
    b = a.copy()
    assert first_difference(a, b) is None
    b["x"][2, 4] = 0x3F800002
    b["nis"][2] = 7
    assert first_difference(a, b) == (
        "step 2, x[4]: expected 1.0 (0x3f800000), found 1.0000002 (0x3f800002), 2 ulp apart"
    )
    assert differing_bits(a, b) == 4
    b = a.copy()
    b["feedback"][1] = 2
    assert first_difference(a, b) == "step 1, feedback: expected 0, found 2"


def test_minus_zero_and_nan_are_differences():
    a = np.zeros(1, TRACE)
    for other in (0x80000000, 0x7FC00000, 0x7FC00001):
        b = a.copy()
        b["P"][0, 3] = other
        assert first_difference(a, b) is not None
        assert first_difference(b, b) is None


def test_ulps_count_across_zero():
    assert ulps(np.uint32(1), np.uint32(0x80000001)) == 2
    assert ulps(np.uint32(0x3F7FFFFF), np.uint32(0x3F800000)) == 1
    assert ulps(np.uint32(0), np.uint32(0x80000000)) == 0
