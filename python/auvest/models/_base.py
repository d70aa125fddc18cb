"""What every model has in common: its size, its names, and its counterpart in the core."""

from __future__ import annotations

import json
import math
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import (
    DType,
    Floats,
    as_array,
    as_number,
    far_from_origin,
    require_range,
)
from auvest._core import Status
from auvest._fields import Checked
from auvest._state import describe

if TYPE_CHECKING:
    from typing_extensions import Self

    from auvest._core import _Process, _Sensor

_FLOAT64 = np.dtype(np.float64)


class Model(Checked):
    """A frozen dataclass of parameters that knows its counterpart in the core.

    Handles on the core are made when they are first needed and stay with the model; they are no
    part of its value, and are not pickled.
    """

    #: Fields that choose the core's class and are no parameters of it.
    structural: ClassVar[tuple[str, ...]] = ()

    @property
    def core_name(self) -> str:
        """Name of the model in the core's registry."""
        return type(self).__name__

    def _core_params(self) -> dict[str, float]:
        """Give the parameters under their names in the core."""
        return {
            field.name: getattr(self, field.name)
            for field in fields(self)  # type: ignore[arg-type]
            if field.name not in self.structural
        }

    def _core_defaults(self) -> dict[str, float]:
        """Give the core's own parameters by name, in its order."""
        raise NotImplementedError

    def values(self, dtype: str) -> Floats:
        """Give the parameters in the core's order; refuse those that ``dtype`` cannot hold."""
        params = self._core_params()
        squared = tuple(name for name in params if name.startswith("sigma_"))
        finite = {name: value for name, value in params.items() if not math.isinf(value)}
        require_range(finite, dtype, squared=squared if self._squares else ())
        return np.array([params[name] for name in self._core_defaults()], dtype)

    #: Whether the sigmas are squared before they are used.
    _squares: ClassVar[bool] = False

    #: What a model of one's own has left out that an EKF needs: ``"H(x)"``; empty: nothing.
    lacks: ClassVar[str] = ""

    def _handle(self, key: Any, make: Any) -> Any:
        handles = self.__dict__.get("_handles")
        if handles is None:
            handles = {}
            object.__setattr__(self, "_handles", handles)
        if key not in handles:
            handles[key] = make()
        return handles[key]

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_handles"}


#: Begins what is kept instead of a description where a model cannot be described.
UNSAVED = "!"


def saved_as(model: Model) -> str:
    """Describe a model as JSON; where it cannot be, give the reason behind UNSAVED."""
    try:
        return json.dumps(describe(model))
    except ValueError as error:
        return f"{UNSAVED}{error}"


class ProcessModel(Model):
    """A process model: how the state moves, and what noise drives it.

    Attributes
    ----------
    state : tuple of str
        Names of the states, with units.
    input : tuple of str
        Names of the numbers that drive a prediction; empty if there are none.
    """

    state: tuple[str, ...] = ()
    input: ClassVar[tuple[str, ...]] = ()

    def _core_defaults(self) -> dict[str, float]:
        return _core.process_defaults(self.core_name)

    def core(self, dtype: DType) -> _Process[Any]:
        """Give the core's process model in this precision."""

        def make() -> Any:
            make_process = getattr(_core, f"make_process_{dtype.name}")
            return make_process(self.core_name, self.values(dtype.name))

        return self._handle(dtype.name, make)

    def f(
        self, x: npt.ArrayLike, dt: float, input: npt.ArrayLike | None = None
    ) -> npt.NDArray[np.float64]:
        """State (n,) after ``dt >= 0`` seconds without noise, in float64."""
        state = as_array("x", x, (len(self.state),), _FLOAT64)
        return self.core(_FLOAT64).f(
            state, as_number("dt", dt, "not negative"), self._as_input(input)
        )

    def Phi(
        self, dt: float, x: npt.ArrayLike | None = None, input: npt.ArrayLike | None = None
    ) -> npt.NDArray[np.float64]:
        """Jacobian (n, n) of ``f`` at ``x``, in float64; a linear process needs no ``x``."""
        if self.lacks:
            raise ValueError(f"{type(self).__name__} has no {self.lacks}")
        state: npt.NDArray[np.float64] = np.zeros(len(self.state))
        if x is not None:
            state = as_array("x", x, (len(self.state),), _FLOAT64).astype(np.float64)
        return self.core(_FLOAT64).Phi(
            state, as_number("dt", dt, "not negative"), self._as_input(input)
        )

    def Q(self, dt: float, input: npt.ArrayLike | None = None) -> npt.NDArray[np.float64]:
        """Covariance (n, n) of the process noise of ``dt >= 0`` seconds, in float64."""
        return self.core(_FLOAT64).Q(as_number("dt", dt, "not negative"), self._as_input(input))

    def _as_input(self, input: npt.ArrayLike | None) -> npt.NDArray[np.float64]:
        if input is None:
            return np.zeros(len(self.input))
        return as_array("input", input, (len(self.input),), _FLOAT64).astype(np.float64)


class MeasurementModel(Model):
    """A measurement model: what a sensor would read in a state, and its noise.

    Attributes
    ----------
    observes : tuple of str
        Names of the leading states that the measurement depends on.
    measures : tuple of str
        Names of the numbers of a measurement, with units.
    place : str or None
        Name of the field that comes with each measurement and is no part of it: where the station
        or the leader stood, how the instrument was headed; None: nothing does.
    """

    observes: ClassVar[tuple[str, ...]] = ("x_m", "y_m")
    measures: tuple[str, ...] = ()
    place: ClassVar[str | None] = None
    #: What `place` names in the core where the model does not say; nothing is measured from there.
    _elsewhere: ClassVar[Any] = None
    _squares = True

    @property
    def stands(self) -> bool:
        """Whether a measurement needs no ``place``: the model has it, or has no use for one."""
        return self.place is None or getattr(self, self.place) is not None

    def standing(self) -> Self:
        """Give the same model where it stands: itself or, if it does not, where C++ puts it."""
        if self.place is None or self.stands:
            return self
        return replace(self, **{self.place: self._elsewhere})  # type: ignore[type-var]

    def _core_defaults(self) -> dict[str, float]:
        return _core.sensor_defaults(self.core_name)

    def _how_for_more(self, states: int) -> str:  # noqa: ARG002
        """Say how to make it for another number of states; empty where there is no way."""
        return ""

    def core(self, states: int, dtype: DType) -> _Sensor[Any]:
        """Give the core's measurement model for so many states in this precision.

        Raises
        ------
        ValueError
            If there is none for so many.
        """

        def make() -> Any:
            known = _core.sensor_states(self.core_name)
            if states not in known:
                numbers = ", ".join(str(n) for n in known)
                raise ValueError(
                    f"{type(self).__name__} is made for {numbers} states, not for {states}"
                    f"{self._how_for_more(states)}"
                )
            make_sensor = getattr(_core, f"make_sensor_{dtype.name}")
            try:
                sensor = make_sensor(self.core_name, states, self.values(dtype.name))
            except _core.StatusError as error:
                if error.status != Status.far_from_origin or self.place is None:
                    raise
                place = np.array(getattr(self.standing(), self.place))
                raise ValueError(far_from_origin(self.place, place, dtype)) from None
            sensor.description = saved_as(self)
            sensor.stands = self.stands
            return sensor

        return self._handle((states, dtype.name), make)

    def h(self, x: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Measurements without noise.

        Parameters
        ----------
        x : array_like, shape (n,) or (K, n)
            States, or their leading components: all that the measurement depends on.

        Returns
        -------
        ndarray, shape (m,) or (K, m)

        Raises
        ------
        ValueError
            If a shape is wrong, a state so large that its measurement is not finite, or the model
            does not say where it stands.
        """
        if not self.stands:
            name = type(self).__name__
            raise ValueError(
                f"{name} was made without {self.place}, which this needs: {name}({self.place}=...)"
            )
        least = len(self.observes)
        shape = np.shape(x)
        if len(shape) not in (1, 2) or shape[-1] < least:
            raise ValueError(
                f"x has shape {shape}, expected (n,) or (K, n) with n at least {least}"
            )
        rows = np.atleast_2d(as_array("x", x, (None,) * len(shape), _FLOAT64))
        states = min(n for n in _core.sensor_states(self.core_name) if n >= least)
        leading = np.zeros((len(rows), states))
        leading[:, : min(states, rows.shape[1])] = rows[:, :states]
        z: npt.NDArray[np.float64] = self.core(states, _FLOAT64).h(leading)
        if not np.isfinite(z).all():
            raise ValueError("x would be measured as what is not finite: is it too large?")
        return z[0] if len(shape) == 1 else z

    def check_process(self, process: ProcessModel) -> None:
        """Refuse a process whose state does not begin with what this measurement depends on.

        Raises
        ------
        ValueError
        """
        if process.state[: len(self.observes)] != self.observes:
            raise ValueError(
                f"{type(self).__name__} observes {', '.join(self.observes)}, but the state of "
                f"{type(process).__name__} begins with "
                f"{', '.join(process.state[: len(self.observes)])}"
                f"{self._how_to_name(process)}"
            )

    def _how_to_name(self, process: ProcessModel) -> str:  # noqa: ARG002
        """Say how the states get names; empty where they have theirs."""
        return ""
