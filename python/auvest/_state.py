r"""What ``save`` of every filter gives, and how ``restore`` refuses what is not its own.

A saved state is ``bytes``, all numbers little-endian::

    8    the magic b"auvest\r\n"
    4    version of the format, unsigned
    8    length of all of it, unsigned
    4    length of the header, unsigned
         the header, JSON: {"kind": ..., "description": {...},
         "arrays": [[name, dtype, shape], ...]}
         the arrays, one behind the other, C-contiguous
    4    CRC-32 of everything before it, unsigned

``kind`` is the filter's class, ``description`` all that must be the same in the filter that takes
the state: models and their parameters, precision, options. Magic, version, length and CRC-32 have
these places in every version, so that a damaged state is told from one of another version.
"""

from __future__ import annotations

import json
import math
import struct
import zlib
from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest._arguments import type_name

#: The version that :func:`pack` writes, the only one that :func:`unpack` takes.
VERSION = 1

#: What JSON can say. Tuples come back as lists and count as equal to them.
Description: TypeAlias = Mapping[str, Any]

_MAGIC = b"auvest\r\n"  # a transfer as text, which translates the ends of lines, breaks it at once
_PREFIX = struct.Struct("<8sIQI")
_CHECKSUM = struct.Struct("<I")
_DTYPES = ("|b1", "|u1", "<u4", "<i8", "<f4", "<f8")


def pack(kind: str, description: Description, arrays: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """Make a saved state.

    Parameters
    ----------
    kind : str
        Name of the filter's class.
    description : mapping
        What a filter must have in common with this one to take its state, as JSON can say it; see
        :func:`describe`.
    arrays : mapping of str to ndarray
        The state: bool, uint8, uint32, int64, float32 or float64 of any shape.
    """
    table = []
    payload = []
    for name, array in arrays.items():
        plain = np.asarray(array)
        plain = plain.astype(plain.dtype.newbyteorder("<"), copy=False)
        if plain.dtype.str not in _DTYPES:
            raise TypeError(f"{name} is of {plain.dtype.name}, which a state does not hold")
        table.append([name, plain.dtype.str, plain.shape])
        payload.append(plain.tobytes())
    header = json.dumps({"kind": kind, "description": description, "arrays": table}).encode()
    body = b"".join((header, *payload))
    length = _PREFIX.size + len(body) + _CHECKSUM.size
    state = _PREFIX.pack(_MAGIC, VERSION, length, len(header)) + body
    return state + _CHECKSUM.pack(zlib.crc32(state))


def unpack(state: object, kind: str, description: Description) -> dict[str, npt.NDArray[Any]]:
    """Give the arrays of a state that :func:`pack` made, writable and on their own memory.

    Raises
    ------
    TypeError
        If ``state`` is not bytes.
    ValueError
        If it is damaged, of another version, another class or another description. The message
        names what differs and what was expected.
    """
    header, payload = _open(state)
    if header["kind"] != kind:
        raise ValueError(f"state is that of class {header['kind']}, expected {kind}")
    found = _differences(header["description"], json.loads(json.dumps(description)))
    if found:
        raise ValueError(f"state is that of another {kind}: {'; '.join(found)}")
    arrays = {}
    at = 0
    for name, dtype, shape in _table(header, len(payload)):
        array = np.frombuffer(payload, dtype, math.prod(shape), at)
        arrays[name] = array.reshape(shape).astype(array.dtype.newbyteorder("="))
        at += array.nbytes
    return arrays


def require(
    arrays: Mapping[str, npt.NDArray[Any]],
    dtypes: Mapping[str, npt.DTypeLike],
    optional: str = "",
    single: Collection[str] = (),
) -> None:
    """Refuse arrays that are not those of a state.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        As :func:`unpack` gives them.
    dtypes : mapping of str to dtype
        What there must be. Floats must be finite.
    optional : str
        How the names begin of arrays that may be there as well: all of them or none.
    single : collection of str
        Names of those that are one number; the others have rows.

    Raises
    ------
    ValueError
        If one is missing, of another type, or not finite, one number instead of rows or rows
        instead of one number, or there is one too many.
    """
    wanted = dict(dtypes)
    if optional and not any(name.startswith(optional) for name in arrays):
        wanted = {name: dtype for name, dtype in dtypes.items() if not name.startswith(optional)}
    for name in sorted(wanted.keys() ^ arrays.keys()):
        raise ValueError(f"state is damaged: {name} is {'missing' if name in wanted else 'new'}")
    for name in wanted:
        array = arrays[name]
        if array.dtype != np.dtype(dtypes[name]):
            raise ValueError(
                f"state is damaged: {name} is of {array.dtype.name}, "
                f"expected {np.dtype(dtypes[name]).name}"
            )
        if (array.ndim == 0) != (name in single):
            raise ValueError(f"state is damaged: {name} has the shape {array.shape}")
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            raise ValueError(f"state is damaged: {name} has a number that is not finite")


def describe(value: Any) -> Any:
    """Say in JSON what a model is: a dataclass becomes its class and its fields, by name.

    What has a method ``description`` says so itself, or raises ValueError.
    """
    if hasattr(value, "description"):
        return value.description()
    if is_dataclass(value) and not isinstance(value, type):
        parts = {field.name: describe(getattr(value, field.name)) for field in fields(value)}
        return {"class": type(value).__name__, **parts}
    return value


def _open(state: object) -> tuple[dict[str, Any], memoryview]:
    """Give the header of a state that is whole, and its arrays."""
    if not isinstance(state, (bytes, bytearray, memoryview)):
        raise TypeError(f"state must be bytes from save(), not {type_name(state)}")
    raw = memoryview(bytes(state))
    start, least = bytes(raw[: len(_MAGIC)]), _PREFIX.size + _CHECKSUM.size
    if not _MAGIC.startswith(start):
        raise ValueError(f"state is not from save(): it begins with {start!r}, expected {_MAGIC!r}")
    if len(raw) < least:
        raise ValueError(f"state is cut short: it has {len(raw)} bytes, a state at least {least}")
    _, version, length, header_length = _PREFIX.unpack_from(raw)
    if len(raw) != length:
        raise ValueError(f"state is damaged: it has {len(raw)} bytes, expected {length}")
    (checksum,) = _CHECKSUM.unpack_from(raw, length - _CHECKSUM.size)
    found = zlib.crc32(raw[: -_CHECKSUM.size])
    if found != checksum:
        raise ValueError(f"state is damaged: its CRC-32 is {found:08x}, expected {checksum:08x}")
    if version != VERSION:
        raise ValueError(f"state has version {version} of the format, expected {VERSION}")
    body = raw[_PREFIX.size : -_CHECKSUM.size]
    try:
        header = json.loads(bytes(body[:header_length]))
    except (ValueError, RecursionError):
        raise ValueError("state is damaged: its header is no JSON") from None
    if not isinstance(header, dict) or not {"kind", "description", "arrays"} <= header.keys():
        raise ValueError("state is damaged: its header lacks kind, description or arrays")
    return header, body[header_length:]


def _table(header: Mapping[str, Any], size: int) -> list[tuple[str, str, list[int]]]:
    """Give name, dtype and shape of the arrays, which take ``size`` bytes."""
    table = header["arrays"]
    found, bytes_taken = [], 0
    for row in table if isinstance(table, list) else [table]:
        name, dtype, shape = row if isinstance(row, list) and len(row) == 3 else (None, None, None)
        if (
            not isinstance(name, str)
            or dtype not in _DTYPES
            or not isinstance(shape, list)
            or not all(type(extent) is int and 0 <= extent <= size for extent in shape)
            or len(shape) > 2
        ):
            raise ValueError(f"state is damaged: its arrays have {_short(row)}")
        found.append((name, dtype, shape))
        bytes_taken += np.dtype(dtype).itemsize * math.prod(shape)
    if bytes_taken != size or len({name for name, _, _ in found}) < len(found):
        raise ValueError(
            f"state is damaged: its arrays say that they have {bytes_taken} bytes, it has {size}"
        )
    return found


def _differences(have: Any, want: Any, path: str = "") -> list[str]:
    """Name what differs between two descriptions, by the path to it."""
    if not (isinstance(have, dict) and isinstance(want, dict)):
        return [] if have == want else [f"{path} is {_short(have)}, expected {_short(want)}"]
    if have.get("class") != want.get("class"):
        return [f"{path} is {_short(have)}, expected {_short(want)}"]
    found = []
    for key in {**want, **have}:
        inner = f"{path}.{key}" if path else key
        if key not in want:
            found.append(f"{inner} is {_short(have[key])}, expected nothing of that name")
        elif key not in have:
            found.append(f"{inner} is missing, expected {_short(want[key])}")
        else:
            found += _differences(have[key], want[key], inner)
    return found


def _short(value: Any) -> str:
    """Write a model as the name of its class, anything else as Python does."""
    if isinstance(value, dict) and "class" in value:
        return str(value["class"])
    return repr(value)
