"""Hulls in the water: a torpedo and an ROV in six degrees of freedom or fewer.

The equations are C++ (``cpp/include/auvest/vehicle``, docs/algorithms/vehicle.md). Axes are north,
east, down and body x forward, y to starboard, z down; angles are Euler's, zyx, in rad.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import DType, Floats, as_array, as_dtype, as_integer, as_kind, as_number
from auvest._core import Status

Name: TypeAlias = Literal["remus100", "bluerov2_heavy"]
Method: TypeAlias = Literal["rk4", "semi-implicit"]
NAMES: tuple[Name, ...] = ("remus100", "bluerov2_heavy")

_POSE = ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")
_VELOCITY = ("u_m_s", "v_m_s", "w_m_s", "p_rad_s", "q_rad_s", "r_rad_s")
_ACTUATORS: Mapping[str, tuple[str, ...]] = {
    "remus100": ("rudder_rad", "stern_planes_rad", "propeller_rev_s"),
    "bluerov2_heavy": tuple(f"thruster_{i}" for i in range(1, 9)),
}


def parameters(name: Name) -> dict[str, Any]:
    """Give the parameters of a vehicle: a dict of groups, with units in the names.

    Raises
    ------
    ValueError
        If there is no such vehicle.
    """
    as_kind("name", name, NAMES)
    found: dict[str, Any] = _core.vehicle_parameters(name)
    return found


@dataclass(frozen=True)
class HullRun:
    """What :meth:`Hull.run` returns; row 0 is the start.

    Attributes
    ----------
    time_s : ndarray, shape (T + 1,)
    pose : ndarray, shape (T + 1, 6)
        North, east, down (m), roll, pitch, yaw (rad; yaw is not wrapped). What is not free is 0.
    velocity : ndarray, shape (T + 1, 6)
        u, v, w (m/s), p, q, r (rad/s) through the water, in the body's frame.
    actuators : ndarray, shape (T + 1, k)
        Their state: rad and rev/s, or N.
    """

    time_s: Floats
    pose: Floats
    velocity: Floats
    actuators: Floats


class Hull:
    """A vehicle's hull: forces, and steps in time.

    Parameters
    ----------
    name : {"remus100", "bluerov2_heavy"}
        Vehicle: a torpedo with propeller, rudder and stern planes; an ROV with eight thrusters.
    degrees_of_freedom : {6, 5, 4, 3}
        All; without roll; surge, sway, roll and yaw; the plane. A projection fixes the others.
    changes : mapping, optional
        Other values for some of :func:`parameters`, nested like these.
    dtype : {"float64", "float32"}
        Precision; float32 gives the bits of the chip.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong: a parameter that there is none of, a mass that is not positive, a
        mass matrix that is not positive definite.
    """

    def __init__(
        self,
        name: Name,
        *,
        degrees_of_freedom: int = 6,
        changes: Mapping[str, Any] | None = None,
        dtype: npt.DTypeLike = "float64",
    ) -> None:
        known = parameters(name)
        self._name = name
        self._dtype = as_dtype(dtype)
        self._freedom = as_integer("degrees_of_freedom", degrees_of_freedom, 3, 6)
        self._parameters = _merged("changes", known, changes or {})
        try:
            make = getattr(_core, f"make_hull_{self._dtype.name}")
            self._core = make(name, self._freedom, self._parameters)
        except _core.StatusError as error:
            given = "its mass matrix is not positive definite"
            if error.status != Status.not_positive_definite:
                given = "a parameter is out of its range (masses and lengths are positive)"
            raise ValueError(f"changes={dict(changes or {})} are refused: {given}") from None

    @property
    def name(self) -> Name:
        """The vehicle."""
        return self._name

    @property
    def dtype(self) -> DType:
        """float32 or float64."""
        return self._dtype

    @property
    def degrees_of_freedom(self) -> int:
        """How many are free."""
        return self._freedom

    @property
    def parameters(self) -> dict[str, Any]:
        """Its parameters, a copy."""
        return _merged("", self._parameters, {})

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the velocities that are free."""
        return tuple(_VELOCITY[axis] for axis in self._core.axes)

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names of the numbers of a command."""
        return _ACTUATORS[self._name]

    @property
    def mass_matrix(self) -> Floats:
        """M = M_RB + M_A, shape (6, 6), kg, kg m and kg m^2."""
        matrix: Floats = self._core.mass_matrix
        return matrix

    def largest_stable_step(
        self,
        command: npt.ArrayLike,
        *,
        velocity: npt.ArrayLike | None = None,
        method: Method = "rk4",
    ) -> float:
        """Longest step (s) that is stable at these velocities, the actuators as commanded.

        Parameters
        ----------
        command : array_like, shape (k,)
            What ``actuators`` names.
        velocity : array_like, shape (6,), optional
            Through the water, body axes; default: at rest.
        method : {"rk4", "semi-implicit"}
            How steps are taken.
        """
        given = as_array("command", command, (len(self.actuators),), self._dtype)
        state = self._state(None, velocity, given if self._name == "remus100" else None)
        rk4 = as_kind("method", method, ("rk4", "semi-implicit")) == "rk4"
        return float(self._core.largest_stable_step(state, given, rk4))

    def run(
        self,
        commands: npt.ArrayLike,
        dt: float,
        *,
        pose: npt.ArrayLike | None = None,
        velocity: npt.ArrayLike | None = None,
        actuators: npt.ArrayLike | None = None,
        current: npt.ArrayLike = (0.0, 0.0, 0.0),
        method: Method = "rk4",
    ) -> HullRun:
        """Move the hull, the command of row k held over step k.

        Parameters
        ----------
        commands : array_like, shape (T, k)
            What ``actuators`` names.
        dt : float
            Step, s, positive and at most :meth:`largest_stable_step`.
        pose, velocity : array_like, shape (6,), optional
            Start; velocities through the water, body axes; default: 0.
        actuators : array_like, shape (k,), optional
            Their state at the start; default: 0.
        current : array_like, shape (3,)
            Of the water, north, east, down, m/s.
        method : {"rk4", "semi-implicit"}
            Fourth order, or one evaluation per step.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong, or the step is longer than the largest stable one.
        RuntimeError
            If the run leaves what the equations hold for: pitch beyond 80 degrees, an overflow.
        """
        step = as_number("dt", dt, "positive")
        rows = as_array("commands", commands, (None, len(self.actuators)), self._dtype)
        stream = as_array("current", current, (3,), self._dtype)
        state = self._state(pose, velocity, actuators)
        rk4 = as_kind("method", method, ("rk4", "semi-implicit")) == "rk4"
        most = float(self._core.largest_stable_step(state, rows[0], rk4))
        if step > most:
            raise ValueError(f"dt must be at most {most:.4g} s for {method} here, not {step}")
        done, status, states = self._core.run(state, rows, stream, step, rk4)
        if status != Status.ok:
            raise RuntimeError(f"step {done}: {_core.describe(status)}")
        axes = list(self._core.axes)
        count = len(axes)
        poses, velocities = (np.zeros((len(states), 6), self._dtype) for _ in range(2))
        if pose is not None:
            poses[:] = as_array("pose", pose, (6,), self._dtype)
        poses[:, axes], velocities[:, axes] = states[:, :count], states[:, count : 2 * count]
        time_s = step * np.arange(len(states))
        return HullRun(time_s, poses, velocities, states[:, 2 * count :])

    def _state(
        self,
        pose: npt.ArrayLike | None,
        velocity: npt.ArrayLike | None,
        actuators: npt.ArrayLike | None,
    ) -> Floats:
        parts = []
        for name, values in (("pose", pose), ("velocity", velocity)):
            whole = np.zeros(6) if values is None else values
            parts.append(as_array(name, whole, (6,), self._dtype)[self._core.axes])
        size = len(self.actuators)
        given = np.zeros(size) if actuators is None else actuators
        parts.append(as_array("actuators", given, (size,), self._dtype))
        return np.ascontiguousarray(np.concatenate(parts), self._dtype)


def _merged(path: str, known: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Give ``known`` with the changes; refuse names that it has not."""
    merged: dict[str, Any] = {}
    for name in changes:
        if name not in known:
            raise ValueError(f"{path} has no parameter {name!r}, but {', '.join(known)}")
    for name, value in known.items():
        here = f"{path}.{name}"
        if isinstance(value, dict):
            merged[name] = _merged(here, value, changes.get(name, {}))
        elif name not in changes or isinstance(value, bool):
            merged[name] = bool(changes.get(name, value)) if isinstance(value, bool) else value
        else:
            merged[name] = as_number(here, changes[name], infinite=True)
    return merged
