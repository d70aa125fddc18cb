"""Models written as Python functions, for a first try; see docs/models.md for models in C++."""

from __future__ import annotations

import importlib
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import DType, as_array, as_covariance, as_integer, type_name
from auvest.models._base import MeasurementModel, ProcessModel, saved_as

Array: TypeAlias = npt.NDArray[np.float64]

_FLOAT64 = np.dtype(np.float64)


class _Raised(threading.local):
    """What functions raised in this thread: C++ carries no exception of Python through a filter."""

    def __init__(self) -> None:
        self.errors: list[BaseException] = []

    def keep(self, error: BaseException) -> None:
        self.errors.append(error)


_RAISED = _Raised()


def require_none_raised() -> None:
    """Raise the first of what functions of models raised in this thread since the last time."""
    errors, _RAISED.errors = _RAISED.errors, []
    if errors:
        raise errors[0]


class FunctionProcess(ProcessModel):
    """A process model from Python functions, in double precision.

    Parameters
    ----------
    f : callable
        ``f(x, dt)`` gives the state (n,) after ``dt`` seconds without noise; with ``input``,
        ``f(x, dt, u)``.
    Q : callable or array_like, shape (n, n)
        ``Q(dt)``, the covariance of the process noise of ``dt`` seconds; an array is the covariance
        per second, ``Q(dt) = Q * dt``.
    jacobian : callable, optional
        Jacobian (n, n) of ``f`` with respect to x, with the arguments of ``f``. Default: central
        differences of fourth order with a step of ``1e-3 max(1, |x|)``; relative errors are about
        1e-12 where ``f`` is smooth on the scale of its argument.
    state : int or sequence of str
        How many states there are, 1 to 9, or their names. Sensors that see a position need the
        names: ``("x_m", "y_m", ...)``.
    input : sequence of str
        Names of the numbers that drive a prediction, at most 8.
    angles : sequence of int
        States that ``f`` wraps to (-pi, pi]; their differences are wrapped too.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong.
    """

    def __init__(
        self,
        f: Callable[..., npt.ArrayLike],
        Q: Callable[[float], npt.ArrayLike] | npt.ArrayLike,
        jacobian: Callable[..., npt.ArrayLike] | None = None,
        *,
        state: int | Sequence[str],
        input: Sequence[str] = (),
        angles: Sequence[int] = (),
    ) -> None:
        self.function = _as_function("f", f)
        self.state = _as_names(state)
        if len(input) > 8:
            raise ValueError(f"input must have at most 8 names, not {len(input)}")
        self.input: tuple[str, ...] = tuple(input)  # type: ignore[misc]
        n = len(self.state)
        self.noise = Q if callable(Q) else _as_noise(Q, n)
        self.jacobian = None if jacobian is None else _as_function("jacobian", jacobian)
        self.angles = _as_places("angles", angles, n)

    def core(self, dtype: DType) -> Any:
        """Give the core's process model; float32 is refused."""
        _require_double(self, dtype)
        noise = self.noise if callable(self.noise) else _PerSecond(self.noise)
        return self._handle(
            "float64",
            lambda: _core.make_function_process(
                len(self.state),
                len(self.input),
                self.function,
                noise,
                self.jacobian,
                list(self.angles),
                _RAISED.keep,
            ),
        )

    def f(self, x: npt.ArrayLike, dt: float, input: npt.ArrayLike | None = None) -> Array:
        """As :meth:`ProcessModel.f`; raises what the function raises."""
        return _done(super().f(x, dt, input))

    def Phi(
        self, dt: float, x: npt.ArrayLike | None = None, input: npt.ArrayLike | None = None
    ) -> Array:
        """As :meth:`ProcessModel.Phi`; raises what the function raises."""
        return _done(super().Phi(dt, x, input))

    def Q(self, dt: float, input: npt.ArrayLike | None = None) -> Array:
        """As :meth:`ProcessModel.Q`; raises what the function raises."""
        return _done(super().Q(dt, input))

    def description(self) -> dict[str, Any]:
        """Say what the model is, for saved states; functions are named by module and name.

        Raises
        ------
        ValueError
            If a function cannot be named: a lambda, a local function, a bound object.
        """
        noise = self.noise
        return {
            "class": "FunctionProcess",
            "f": _name("f", self.function),
            "Q": _name("Q", noise) if callable(noise) else noise.tolist(),
            "jacobian": None if self.jacobian is None else _name("jacobian", self.jacobian),
            "state": list(self.state),
            "input": list(self.input),
            "angles": list(self.angles),
        }


class FunctionSensor(MeasurementModel):
    """A measurement model from Python functions, in double precision.

    Parameters
    ----------
    h : callable
        ``h(x)`` gives the measurement (m,) of a state (n,) without noise.
    R : array_like, shape (m, m), or float
        Covariance of its noise; m is at most 4.
    jacobian : callable, optional
        ``jacobian(x)``, the Jacobian (m, n) of ``h``. Default: as for :class:`FunctionProcess`.
    angles : sequence of int
        Components that are angles (rad): their innovations are wrapped to (-pi, pi].

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong.
    """

    observes = ()

    def __init__(
        self,
        h: Callable[[Array], npt.ArrayLike],
        R: npt.ArrayLike,
        jacobian: Callable[[Array], npt.ArrayLike] | None = None,
        *,
        angles: Sequence[int] = (),
    ) -> None:
        self.function = _as_function("h", h)
        size = 1 if np.ndim(R) == 0 else np.shape(R)[0]
        as_integer("the size of R", size, 1, _core.MAX_FUNCTION_SIZE)
        square = np.reshape(R, (1, 1)) if np.ndim(R) == 0 else R
        self.R = as_covariance("R", square, size, _FLOAT64).astype(np.float64)
        if np.linalg.eigvalsh(self.R)[0] <= 0:
            raise ValueError("R must be positive definite")
        self.measures = tuple(f"z_{i}" for i in range(size))
        self.jacobian = None if jacobian is None else _as_function("jacobian", jacobian)
        self.angles = _as_places("angles", angles, size)

    def core(self, states: int, dtype: DType) -> Any:
        """Give the core's measurement model for so many states; float32 is refused."""
        _require_double(self, dtype)
        if states > _core.MAX_FUNCTION_STATES:
            raise ValueError(f"FunctionSensor takes at most 9 states, not {states}")

        def make() -> Any:
            sensor = _core.make_function_sensor(
                states,
                len(self.measures),
                self.function,
                self.R,
                self.jacobian,
                list(self.angles),
                _RAISED.keep,
            )
            sensor.description = saved_as(self)
            return sensor

        return self._handle(states, make)

    def h(self, x: npt.ArrayLike) -> Array:
        """Measurements without noise: (m,) of one state (n,), (K, m) of states (K, n)."""
        rows = as_array("x", x, (None,) * np.ndim(x), _FLOAT64)
        if rows.ndim == 1:
            return np.asarray(self.function(rows), np.float64).reshape(-1)
        return np.stack([np.asarray(self.function(row), np.float64).reshape(-1) for row in rows])

    def description(self) -> dict[str, Any]:
        """Say what the model is, for saved states; see :meth:`FunctionProcess.description`.

        Raises
        ------
        ValueError
            If a function cannot be named.
        """
        return {
            "class": "FunctionSensor",
            "h": _name("h", self.function),
            "R": self.R.tolist(),
            "jacobian": None if self.jacobian is None else _name("jacobian", self.jacobian),
            "angles": list(self.angles),
        }


def _done(result: Array) -> Array:
    require_none_raised()
    return result


class _PerSecond:
    """``Q(dt) = Q * dt``."""

    def __init__(self, noise: Array) -> None:
        self._noise = noise

    def __call__(self, dt: float) -> Array:
        return self._noise * dt


def _as_noise(value: npt.ArrayLike, states: int) -> Array:
    """Take a symmetric covariance; states without noise have a row of zeros."""
    array = as_array("Q", value, (states, states), _FLOAT64)
    if not (array == array.T).all() or (np.linalg.eigvalsh(array) < -1e-12 * array.max()).any():
        raise ValueError("Q must be symmetric and positive semidefinite")
    return array.astype(np.float64)


def _as_function(name: str, function: Any) -> Any:
    if not callable(function):
        raise TypeError(f"{name} must be a function, not {type_name(function)}")
    return function


def _as_names(state: int | Sequence[str]) -> tuple[str, ...]:
    if isinstance(state, str):
        raise TypeError("state must be a number or a sequence of names, not a str")
    if isinstance(state, Sequence):
        as_integer("the number of states", len(state), 1, _core.MAX_FUNCTION_STATES)
        return tuple(str(name) for name in state)
    count = as_integer("state", state, 1, _core.MAX_FUNCTION_STATES)
    return tuple(f"x_{i}" for i in range(count))


def _as_places(name: str, places: Sequence[int], size: int) -> tuple[int, ...]:
    return tuple(as_integer(f"{name}[{k}]", i, 0, size - 1) for k, i in enumerate(places))


def _require_double(model: object, dtype: DType) -> None:
    if dtype != _FLOAT64:
        raise ValueError(
            f"{type(model).__name__} is for float64: a Python function has no float32 bits; "
            "write the model in C++ (auvest.load_models) for these"
        )


def from_names(description: dict[str, Any]) -> FunctionSensor:
    """Make the sensor again that described itself; only of modules that are imported already.

    Raises
    ------
    ValueError
        If a function is not there.
    """
    h, jacobian = _named(description["h"]), description["jacobian"]
    return FunctionSensor(
        h,
        description["R"],
        None if jacobian is None else _named(jacobian),
        angles=description["angles"],
    )


def _named(name: str) -> Any:
    module, _, path = name.partition(":")
    found: Any = sys.modules.get(module)
    for part in path.split("."):
        found = getattr(found, part, None)
    if found is None:
        raise ValueError(f"state needs {name}, which is not there; import {module} first")
    return found


def _name(what: str, function: Any) -> str:
    """Name a function by its module and its name in it."""
    module, name = getattr(function, "__module__", None), getattr(function, "__qualname__", None)
    found: Any = None
    if module is not None and name is not None and "<" not in name:
        found = importlib.import_module(module)
        for part in name.split("."):
            found = getattr(found, part, None)
    if found is not function:
        raise ValueError(
            f"{what} cannot be saved: {name or function!r} is not a function that a module names; "
            "define it at the top of a module"
        )
    return f"{module}:{name}"
