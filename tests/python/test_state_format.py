"""The bytes of save(): what goes in comes out, and nothing else is taken."""

import struct
import zlib
from dataclasses import dataclass

import numpy as np
import pytest

from auvest import _state

DESCRIPTION = {
    "dtype": "float32",
    "process": {"class": "Still", "psd": 0.1, "axes": [1, 2]},
    "sensor": None,
}
ARRAYS = {
    "x": np.array([1.0, -0.0, np.nan], np.float32),
    "P": np.arange(6.0).reshape(3, 2),
    "counters": np.array([-3], np.int64),
    "random": np.array([1, 2**32 - 1], np.uint32),
    "flags": np.array([True, False]),
    "mode": np.array(7, np.uint8),
    "none": np.empty((0, 6), np.float32),
}


def packed(**changes):
    return _state.pack("Ekf", {**DESCRIPTION, **changes}, ARRAYS)


def sealed(state):
    """The state with the CRC-32 that belongs to it."""
    return state[:-4] + struct.pack("<I", zlib.crc32(state[:-4]))


def test_arrays_come_back_with_all_their_bits():
    arrays = _state.unpack(packed(), "Ekf", DESCRIPTION)
    assert list(arrays) == list(ARRAYS)
    for name, array in arrays.items():
        assert array.dtype == ARRAYS[name].dtype
        assert array.shape == ARRAYS[name].shape
        assert array.tobytes() == ARRAYS[name].tobytes()  # the sign of zero and NaN too
        assert array.flags.writeable
        assert array.flags.c_contiguous


def test_layout_of_a_small_state_byte_by_byte():
    header = b'{"kind": "K", "description": {"n": 1}, "arrays": [["x", "<u4", [2]]]}'
    start = b"auvest\r\n" + struct.pack("<IQI", 1, 24 + len(header) + 8 + 4, len(header))
    body = start + header + b"\x01\x00\x00\x00\x02\x01\x00\x00"
    expected = body + struct.pack("<I", zlib.crc32(body))
    assert _state.pack("K", {"n": 1}, {"x": np.array([1, 258], np.uint32)}) == expected


def test_arrays_of_the_other_byte_order_and_strided_ones_are_the_same_state():
    x = np.arange(6, dtype=np.float64).reshape(2, 3)
    straight = _state.pack("K", {}, {"x": x.T.copy()})
    assert _state.pack("K", {}, {"x": x.T}) == straight
    assert _state.pack("K", {}, {"x": x.T.astype(">f8")}) == straight


def test_objects_and_strings_are_not_packed():
    with pytest.raises(TypeError, match="name is of str"):
        _state.pack("K", {}, {"name": np.array(["a"])})
    with pytest.raises(TypeError, match="what is of object"):
        _state.pack("K", {}, {"what": np.array([None])})


def test_every_flipped_byte_is_refused():
    state = packed()
    for place in range(len(state)):
        for bits in (0x01, 0x80, 0xFF):
            damaged = bytearray(state)
            damaged[place] ^= bits
            with pytest.raises(ValueError, match=r"state is (damaged|not from save|cut short)"):
                _state.unpack(bytes(damaged), "Ekf", DESCRIPTION)


def test_every_truncation_and_extension_is_refused():
    state = packed()
    for length in range(len(state)):
        with pytest.raises(ValueError, match=r"state is (damaged|not from save|cut short)"):
            _state.unpack(state[:length], "Ekf", DESCRIPTION)
    for more in (b"\0", b"\0\0\0\0", state, struct.pack("<I", zlib.crc32(state))):
        with pytest.raises(ValueError, match=f"{len(state + more)} bytes, expected {len(state)}"):
            _state.unpack(state + more, "Ekf", DESCRIPTION)


@pytest.mark.parametrize("version", [0, 2])
def test_another_version_is_refused_and_named(version):
    state = bytearray(packed())
    struct.pack_into("<I", state, 8, version)
    with pytest.raises(ValueError, match=f"version {version} of the format, expected 1"):
        _state.unpack(sealed(bytes(state)), "Ekf", DESCRIPTION)


def test_ends_of_lines_translated_are_refused():
    with pytest.raises(ValueError, match=r"begins with b'auvest\\n.*expected b'auvest\\r\\n'"):
        _state.unpack(packed().replace(b"\r\n", b"\n"), "Ekf", DESCRIPTION)


def test_another_class_is_refused_and_named():
    with pytest.raises(ValueError, match="class Ekf, expected Ukf"):
        _state.unpack(packed(), "Ukf", DESCRIPTION)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dtype": "float64"}, "dtype is 'float64', expected 'float32'"),
        (
            {"process": {"class": "Still", "psd": 0.2, "axes": [1, 2]}},
            r"process\.psd is 0\.2, expected 0\.1$",
        ),
        (
            {"process": {"class": "Still", "psd": 0.1, "axes": [1, 3]}},
            r"process\.axes is \[1, 3\], expected \[1, 2\]",
        ),
        ({"process": {"class": "Moving", "psd": 0.1}}, "process is Moving, expected Still$"),
        ({"process": {"class": "Still", "psd": 0.1}}, r"process\.axes is missing, expected \[1, 2"),
        ({"sensor": {"class": "Eye"}}, "sensor is Eye, expected None"),
        ({"more": 1}, "more is 1, expected nothing of that name"),
        (
            {"process": {**DESCRIPTION["process"], "more": 1}},
            r"process\.more is 1, expected nothing of that name",
        ),
    ],
)
def test_another_description_is_refused_and_what_differs_is_named(change, message):
    with pytest.raises(ValueError, match=f"state is that of another Ekf: {message}"):
        _state.unpack(packed(**change), "Ekf", DESCRIPTION)


def test_all_differences_are_named():
    other = packed(dtype="float64", sensor=1)
    with pytest.raises(ValueError, match=r"dtype is 'float64'.*; sensor is 1, expected None"):
        _state.unpack(other, "Ekf", DESCRIPTION)


@pytest.mark.parametrize("state", [None, {}, "auvest\r\n", 7])
def test_what_is_not_bytes_is_refused(state):
    with pytest.raises(TypeError, match="state must be bytes from save"):
        _state.unpack(state, "Ekf", DESCRIPTION)


def test_bytearray_and_memoryview_are_bytes_too():
    for kind in (bytearray, memoryview):
        arrays = _state.unpack(kind(packed()), "Ekf", DESCRIPTION)
        assert arrays["counters"][0] == -3


@dataclass(frozen=True)
class Inner:
    k: float = 2.0


@dataclass(frozen=True)
class Outer:
    inner: Inner = Inner()
    share: tuple[float, float] = (0.25, 0.75)


def test_a_model_is_described_by_class_and_fields():
    description = {"model": _state.describe(Outer())}
    inner = {"class": "Inner", "k": 2.0}
    assert description == {"model": {"class": "Outer", "inner": inner, "share": (0.25, 0.75)}}
    state = _state.pack("K", description, {})
    assert _state.unpack(state, "K", description) == {}  # tuples too
    other = {"model": _state.describe(Outer(inner=Inner(k=3)))}
    with pytest.raises(ValueError, match=r"model\.inner\.k is 2\.0, expected 3"):
        _state.unpack(state, "K", other)
