""":class:`Outage`: a filter takes over while communication is down."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import Exclusive, Floats, as_array, as_instance, far_from_origin
from auvest._core import Status
from auvest._texts import counted
from auvest.errors import FilterError
from auvest.slat._base import SlatFilter, Steps, as_covariance
from auvest.slat.dead_reckoning import DeadReckoning
from auvest.slat.ekf_slat import EkfSlat
from auvest.slat.slatf import Slatf
from auvest.slat.slatf_joint import SlatfJoint


class Outage(Steps):
    """Section 6 of the paper: a filter takes over while communication is down.

    ``share`` when word comes: the state that all agree on. ``predict`` and ``update`` when none
    comes: the first prediction starts the filter from the last shared state. ``x``, ``P`` and
    ``master`` are the shared state, or the filter's.

    Parameters
    ----------
    filter : Slatf, SlatfJoint, EkfSlat or DeadReckoning
        The prototype; it is copied. Its own state does not matter.

    Raises
    ------
    TypeError
        If it is none of these.
    """

    def __init__(self, filter: SlatFilter) -> None:  # noqa: A002 (its name in this package)
        as_instance("filter", filter, (Slatf, SlatfJoint, EkfSlat, DeadReckoning))
        self._filter = copy.deepcopy(filter)
        self._dtype, self._motion, self._sonar = filter.dtype, filter.motion, filter.sonar
        self._deaf, self._births, self._shared = filter._deaf, filter._births, filter._shared
        self._random = self._filter._random.copy()
        self._status = Status.ok
        self._prepare()

    def _prepare(self) -> None:
        self._exclusive = Exclusive()
        self._device = self._filter._device
        self._settings = self._filter._settings
        name = f"SlatOutage_{self._motion.name}_{self._dtype.name}"
        self._core_steps = getattr(_core, name)(self._filter._core_steps)

    def _description(self) -> dict[str, Any]:
        return {"filter": {"class": type(self._filter).__name__, **self._filter._description()}}

    @property
    def communication(self) -> str:
        """What the last word was: "never" heard, communication "up", or "down"."""
        with self._exclusive:
            return str(self._core_steps.communication)

    def share(
        self,
        x: npt.ArrayLike,
        P: npt.ArrayLike,
        masters: Sequence[tuple[npt.ArrayLike, npt.ArrayLike]] = (),
    ) -> None:
        """Take over what communication brings, and end an outage.

        Parameters
        ----------
        x, P : array_like, shapes (n,) and (n, n)
            The slave's pose and its covariance, which may be singular or zero.
        masters : sequence of (x, P)
            State (6,) and covariance (6, 6) of each master; at most ``MAX_MASTERS``.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong; nothing has changed then.
        """
        n = self._motion.pose_states
        state = as_array("x", x, (n,), self._dtype)
        covariance = as_covariance("P", P, n, self._dtype, definite=False)
        self._require_local("x", state)
        most = self._filter._max_masters
        if len(masters) > most:
            raise ValueError(
                f"masters has {counted(len(masters), 'element')}, at most {most} are taken"
            )
        states = np.empty((len(masters), 6), self._dtype)
        covariances = np.empty((len(masters), 6, 6), self._dtype)
        for k, (one_x, one_p) in enumerate(masters):
            states[k] = as_array(f"masters[{k}][0]", one_x, (6,), self._dtype)
            covariances[k] = as_covariance(f"masters[{k}][1]", one_p, 6, self._dtype, definite=True)
        heard = slice(0 if self._deaf else None)
        with self._exclusive:
            try:
                self._core_steps.share(state, covariance, states[heard], covariances[heard])
            except _core.StatusError as error:
                if error.status == Status.far_from_origin:
                    places = {
                        "x": state,
                        **{f"masters[{k}][0]": one for k, one in enumerate(states)},
                    }
                    name = max(places, key=lambda one: float(np.abs(places[one][:2]).max()))
                    message = far_from_origin(name, places[name][:2], self._dtype)
                    raise ValueError(message) from None
                raise ValueError(f"the shared state is refused: {error}") from None

    def _require_started(self, core: Any, counts: npt.NDArray[np.int64]) -> None:
        if core.communication == "down":  # then the filter runs: its counts are behind two
            super()._require_started(core, counts[2:])

    def _has_slave(self, core: Any) -> bool:
        return bool(core.communication != "never")

    def _slave(self) -> tuple[Floats, Floats]:
        if self._core_steps.communication == "never":
            self._status = Status.not_initialised
            raise FilterError("reading the state", self._status)
        return super()._slave()
