"""Checks of arguments: each names the argument, what was given and what was expected.

The module ``auvest._core`` takes only arrays of the exact dtype; here is where everything else is
converted or refused.
"""

from __future__ import annotations

import math
import numbers
import os
import threading
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NoReturn, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest._texts import counted, either

Floats: TypeAlias = npt.NDArray[np.floating[Any]]
DType: TypeAlias = np.dtype[np.float32] | np.dtype[np.float64]

#: Rows that one call takes at most; a filter goes on where it stopped, so records can be split.
MAX_ROWS = 10_000_000


def type_name(value: object) -> str:
    """Return the name of a value's type; None is called so."""
    return "None" if value is None else type(value).__name__


def as_dtype(value: object) -> DType:
    """Take float32 or float64, from a name, a NumPy type or a NumPy dtype."""
    try:
        # None is NumPy's word for float64, and equal to it.
        dtype = None if value is None else np.dtype(value)  # type: ignore[call-overload]
    except TypeError:
        dtype = None
    if dtype is not None and dtype == np.dtype(np.float32):
        return np.dtype(np.float32)
    if dtype is not None and dtype == np.dtype(np.float64):
        return np.dtype(np.float64)
    raise ValueError(f"dtype must be 'float32' or 'float64', not {value!r}")


def as_kind(name: str, value: object, kinds: tuple[str, ...]) -> str:
    """Take one of a few names."""
    if not isinstance(value, str):
        raise TypeError(f"{name} must be a str, not {type_name(value)}")
    if value not in kinds:
        raise ValueError(f"{name} must be {either(map(repr, kinds))}, not {value!r}")
    return value


def as_flag(name: str, value: object) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} must be True or False, not {value!r}")
    return bool(value)


def as_instance(name: str, value: object, expected: type | tuple[type, ...]) -> Any:
    if not isinstance(value, expected):
        types = expected if isinstance(expected, tuple) else (expected,)
        names = " or ".join(f"auvest.{t.__name__}" for t in types)
        raise TypeError(f"{name} must be an {names}, not {type_name(value)}")
    return value


#: Units by how the names of arguments end, the longest first.
_UNITS = (
    ("_rad_s", "rad/s"),
    ("_rev_s", "rev/s"),
    ("_m_s2", "m/s^2"),
    ("_m_s", "m/s"),
    ("_mps", "m/s"),
    ("_rad", "rad"),
    ("_m2", "m^2"),
    ("_kg", "kg"),
    ("_s", "s"),
    ("_m", "m"),
)
#: What NumPy and Python take for numbers, and what would be taken without its unit.
_NO_NUMBERS = (bool, np.bool_, np.timedelta64, np.datetime64)


def _not_a_number(name: str, kind: str, given: str) -> TypeError:
    """Say what was given in place of a number, and in which unit the number would be."""
    unit = "s" if name == "dt" else next((u for end, u in _UNITS if name.endswith(end)), "")
    hint = f"; its unit is {unit}" if unit else ""
    bare = given.removeprefix("of ")
    if unit == "s" and bare.startswith("timedelta64"):
        hint += f": {name} / np.timedelta64(1, 's')"
    elif unit == "s" and bare == "timedelta":
        hint += f": {name}.total_seconds()"
    return TypeError(f"{name} must be {kind}, not {given}{hint}")


def _is_number(value: object, kind: type) -> bool:
    return isinstance(value, kind) and not isinstance(value, _NO_NUMBERS)


def as_integer(name: str, value: object, low: int, high: int) -> int:
    if not _is_number(value, numbers.Integral):
        raise _not_a_number(name, "an integer", type_name(value))
    number = int(value)  # type: ignore[call-overload]
    if not low <= number <= high:
        raise ValueError(f"{name} must lie in {low}..{high}, not {number}")
    return number


Bound: TypeAlias = Literal["any", "positive", "not negative"]


def as_number(name: str, value: object, bound: Bound = "any", *, infinite: bool = False) -> float:
    """Take a finite real number; ``infinite`` also allows +inf."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not _is_number(value, numbers.Real):
        shape = f" of shape {value.shape}" if isinstance(value, np.ndarray) else ""
        raise _not_a_number(name, "a number", f"{type_name(value)}{shape}")
    try:
        number = float(value)  # type: ignore[arg-type]
    except OverflowError:
        raise ValueError(f"{name} is beyond the range of float64") from None
    if not math.isfinite(number) and not (infinite and number == math.inf):
        raise ValueError(f"{name} must be finite, not {value}")
    if bound == "positive" and number <= 0:
        raise ValueError(f"{name} must be positive, not {number}")
    if bound == "not negative" and number < 0:
        raise ValueError(f"{name} must not be negative, not {number}")
    return number


def require_range(
    params: Mapping[str, float], dtype: str, *, squared: tuple[str, ...] = ()
) -> None:
    """Refuse parameters, or the squares of those in ``squared``, that ``dtype`` cannot hold."""
    limits = np.finfo(dtype)
    for name, value in params.items():
        size = abs(value) * abs(value) if name in squared else abs(value)
        if size > float(limits.max) or (value != 0 and size < float(limits.tiny)):
            what = f"the square of {name}" if name in squared else name
            raise ValueError(f"{name} = {value} does not suit {dtype}: {what} leaves its range")


#: No coordinates of a place on Earth are larger, m.
_NO_PLACE_M = 1e9


def far_from_origin(name: str, place: Floats, dtype: DType) -> str:
    """Say that coordinates, m, are too large for a precision, and what to do."""
    coordinates = [float(value) for value in place if math.isfinite(value)]
    largest = max(coordinates, key=abs)
    if abs(largest) > _NO_PLACE_M:
        return f"{name}[{coordinates.index(largest)}] = {largest:.6g} m is no place on Earth"
    step = float(np.spacing(np.abs(dtype.type(largest))))
    unit = 10.0 ** max(0, math.floor(math.log10(abs(largest))) - 2)
    origin = ", ".join(f"{round(value / unit) * unit:.0f}" for value in coordinates)
    given = ", ".join(f"{value:.10g}" for value in coordinates)
    return (
        f"{name} = ({given}) is too far from the origin: {dtype.name} tells {step:.3g} m apart "
        f"there, which is coarse against the sigmas. Subtract a local origin, such as ({origin}), "
        "from all coordinates"
    )


def warn_of_degrees(argument: str, names: Sequence[str], rows: Floats, stacklevel: int) -> None:
    """Warn of a column of angles that jumps further than angles in radians do.

    Those that are wrapped to a turn jump by 2 pi, to a turn of either sign by 4 pi at most.
    """
    for k, name in enumerate(names):
        if not name.endswith("_rad"):
            continue
        angles = rows[np.isfinite(rows[:, k]), k]
        jumps = np.abs(np.diff(angles))
        if jumps.size > 0 and 4 * math.pi < jumps.max() <= 720:
            i = int(np.argmax(jumps))
            warnings.warn(
                f"{argument}: {name} goes from {angles[i]:.4g} to {angles[i + 1]:.4g} between two "
                "rows; it is in radians. Degrees? np.radians() converts them",
                stacklevel=stacklevel + 1,
            )


def step_too_long(step: str, longest_s: float) -> str:
    """Say that a step is longer than a filter takes, and what may lie behind it."""
    return (
        f"{step} is longer than longest_step_s = {longest_s:g} s: did the clock jump, or is it in "
        "another unit?"
    )


def impossible_range(name: str, range_m: float, limits: Any) -> str:
    """Say that an instrument called ``name`` cannot have measured a range."""
    known = ""
    if hasattr(limits, "smallest_range_m") and hasattr(limits, "largest_range_m"):
        most = limits.largest_range_m
        to = f"to {most:g} m" if math.isfinite(most) else "m or more"
        known = f"; its ranges are {limits.smallest_range_m:g} {to}"
    return f"{name} cannot measure a range of {range_m:g} m{known}; NaN is for no measurement"


def require_range_limits(smallest_m: float, largest_m: float) -> None:
    """Refuse an instrument that could measure no range."""
    if not largest_m > smallest_m:
        raise ValueError(
            f"largest_range_m must be above smallest_range_m = {smallest_m}, not {largest_m}"
        )


def as_pair(name: str, value: object) -> tuple[float, float]:
    """Take two finite numbers, for example a position."""
    array = as_array(name, value, (2,), np.dtype(np.float64))
    return float(array[0]), float(array[1])


def as_array(
    name: str,
    value: object,
    shape: tuple[int | None, ...],
    dtype: DType,
    *,
    missing: bool = False,
) -> Floats:
    """Make a C-contiguous array of ``dtype`` whose elements are finite.

    ``None`` in ``shape`` stands for any number of rows, at least one. Integers and other floats
    are converted; ``missing`` lets rows pass that are NaN throughout.
    """
    raw = as_real(name, value, shape)
    _check_shape(name, raw, shape)
    with np.errstate(over="ignore"):
        array: Floats = np.ascontiguousarray(raw, dtype=dtype)
    bad = ~np.isfinite(array)
    if missing and bad.any():
        bad &= ~np.isnan(array).all(axis=-1, keepdims=True)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        _refuse_element(name, raw, index, dtype, missing)
    return array


def as_covariance(name: str, value: npt.ArrayLike, states: int, dtype: DType) -> Floats:
    """Take a symmetric (n, n) array with positive diagonal. The lower triangle is what counts."""
    array = as_array(name, value, (states, states), dtype)
    variances = np.diagonal(array).astype(np.float64)
    if not (variances > 0).all():
        i = int(np.argmin(variances))
        raise ValueError(
            f"{name}[{i}, {i}] is {variances[i]}; a variance must be positive in {dtype.name}"
        )
    given = np.asarray(value, dtype=np.float64)
    sigma = np.sqrt(variances)
    skew = np.abs(given - given.T) / np.outer(sigma, sigma)
    if skew.max() > 1e-6:
        i, j = (int(k) for k in np.unravel_index(np.argmax(skew), skew.shape))
        raise ValueError(
            f"{name} must be symmetric, but {name}[{i}, {j}] is {given[i, j]} "
            f"and {name}[{j}, {i}] is {given[j, i]}"
        )
    return array


def as_step(dt: object, dtype: DType, name: str = "dt") -> float:
    """Take a time step, s, that this precision can hold."""
    step = as_number(name, dt, "not negative")
    if step > float(np.finfo(dtype).max):
        raise ValueError(f"{name} = {step} is beyond the range of {dtype.name}")
    return step


def as_steps(dt: npt.ArrayLike, rows: int, dtype: DType, name: str = "dt") -> Floats:
    """Take times per row, s: one for all or one each."""
    if np.isscalar(dt) or (isinstance(dt, np.ndarray) and dt.ndim == 0):
        return np.full(rows, as_step(dt, dtype, name), dtype)
    steps = as_array(name, dt, (None,), dtype)
    if len(steps) != rows:
        raise ValueError(
            f"{name} has {counted(len(steps), 'row')} and z has {rows}; they must have the same"
        )
    if (steps < 0).any():
        k = int(np.argmax(steps < 0))
        raise ValueError(f"{name}[{k}] must not be negative, not {steps[k]}")
    return steps


def as_points(alpha: float, beta: float, kappa: float, states: int = 6) -> dict[str, float]:
    """Take the parameters of the sigma points of a filter of so many states."""
    alpha, beta = as_number("alpha", alpha), as_number("beta", beta)
    kappa = as_number("kappa", kappa)
    if not 1e-8 <= alpha <= 1:
        raise ValueError(f"alpha must lie in 1e-8..1, not {alpha}")
    if beta < alpha * alpha:
        raise ValueError(f"beta must be at least alpha**2 = {alpha * alpha}, not {beta}")
    if kappa <= -states:
        raise ValueError(
            f"kappa must be above {-states} (n + kappa > 0 with n = {states}), not {kappa}"
        )
    return {"alpha": alpha, "beta": beta, "kappa": kappa}


def _refuse_element(
    name: str, raw: npt.NDArray[Any], index: tuple[int, ...], dtype: DType, missing: bool
) -> None:
    element = raw[index]
    where = f"{name}[{', '.join(str(i) for i in index)}]"
    if np.isfinite(element):
        largest = float(np.finfo(dtype).max)
        raise ValueError(
            f"{where} is {element}: beyond the range of {dtype.name}, which ends at {largest:.3g}"
        )
    if missing and np.isnan(element):
        what = "measurement" if name == "z" else name
        raise ValueError(
            f"{where} is nan and the rest of the {what} is not; a {what} that is missing is NaN "
            "throughout"
        )
    raise ValueError(f"{where} is {element}; all elements must be finite")


def as_real(name: str, value: object, shape: tuple[int | None, ...]) -> npt.NDArray[Any]:
    """Take real numbers, finite or not; ``shape`` is only for the message."""
    expected = f"an array of shape {_shape(shape)}"
    if value is None:
        raise TypeError(f"{name} must be {expected}, not None")
    if isinstance(value, np.ma.MaskedArray):
        raise TypeError(f"{name} must be {expected}, not a masked array; use {name}.filled(np.nan)")
    try:
        raw = np.asarray(value)
    except ValueError:
        raise ValueError(f"{name} must be {expected}, not rows of different lengths") from None
    if raw.dtype.kind not in "fiu":
        given = "str" if raw.dtype.kind in "US" else raw.dtype.name
        if raw.dtype == object:
            odd = next((x for x in raw.flat if not _is_number(x, numbers.Real)), None)
            given = "object" if odd is None else type(odd).__name__
        raise _not_a_number(name, f"{expected} of real numbers", f"of {given}")
    if isinstance(value, (list, tuple)) and _holds_flag(value):  # NumPy makes numbers of them
        raise _not_a_number(name, f"{expected} of real numbers", "of bool")
    return raw


def _holds_flag(value: object) -> bool:
    """Whether True or False stands among numbers in nested lists."""
    if isinstance(value, (list, tuple)):
        return any(map(_holds_flag, value))
    if isinstance(value, np.ndarray):
        return value.dtype == bool
    return isinstance(value, (bool, np.bool_))


def _check_shape(name: str, raw: npt.NDArray[Any], shape: tuple[int | None, ...]) -> None:
    fits = raw.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(raw.shape, shape, strict=True)
    )
    if not fits:
        hint = ""
        if len(shape) == 1 and raw.ndim == 2 and 1 in raw.shape and raw.size == shape[0]:
            hint = f"; row and column vectors are refused, use {name}.ravel()"
        elif len(shape) == 2 and shape[0] is None and raw.shape == shape[1:]:
            hint = f"; one row is {name}[np.newaxis]"
        elif len(shape) == 2 and raw.shape == shape[::-1]:
            hint = f"; transpose it: {name}.T"
        raise ValueError(f"{name} has shape {raw.shape}, expected {_shape(shape)}{hint}")
    if raw.size == 0:
        raise ValueError(f"{name} is empty: shape {raw.shape}, expected at least one row")
    if shape[0] is None and len(raw) > MAX_ROWS:
        raise ValueError(
            f"{name} has {len(raw)} rows, at most {MAX_ROWS} are taken at once; split the record: "
            "a filter goes on where it stopped"
        )


def _shape(shape: tuple[int | None, ...]) -> str:
    symbols = ["T" if extent is None else str(extent) for extent in shape]
    return f"({symbols[0]},)" if len(symbols) == 1 else f"({', '.join(symbols)})"


def processors() -> int:
    """Count the processors that this process may use, 256 at most."""
    if hasattr(os, "sched_getaffinity"):
        return min(256, len(os.sched_getaffinity(0)))
    return min(256, os.cpu_count() or 1)


def as_workers(workers: int | None) -> int:
    """Return the number of threads: one per processor, unless it is given (1 to 256)."""
    return processors() if workers is None else as_integer("workers", workers, 1, 256)


class InUse:
    """Stands in the place of what another thread is using: says so when it is asked for anything.

    In a process that was forked meanwhile, that thread does not exist.
    """

    def __init__(self) -> None:
        self.__dict__["process"] = os.getpid()

    def __getattr__(self, name: str) -> NoReturn:
        raise RuntimeError(
            "this filter is in use by another thread; use one per thread"
            if self.__dict__["process"] == os.getpid()
            else "this process was forked while another thread was using this filter, which stays "
            "unusable here: copy the filter before, or fork before"
        )


class Exclusive:
    """Refuses the second thread that enters while the first is inside."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._user = InUse()

    def __enter__(self) -> None:
        if not self._lock.acquire(blocking=False):
            self._user.asked  # noqa: B018  (raises)
        self._user = InUse()

    def __exit__(self, *_: object) -> None:
        self._lock.release()
