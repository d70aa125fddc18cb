"""Which filters there are, with which models, and where each runs.

One line per filter: everything that lists filters reads it (``--filter`` of the commands, the table
of ``auvest filters``, the tests of parity and budgets, which fail where a line and a measurement
disagree).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

_PROCESSES = ("ConstantAcceleration", "Odometry", "SpeedHeading", "WhiteAcceleration")
_SENSORS = ("BodyVelocity", "Depth", "LeaderRange", "Position", "RangeBearing")
_MOTIONS = ("CompassMotion", "UnicycleMotion")


@dataclass(frozen=True, kw_only=True)
class Filter:
    """A filter and where it runs.

    Attributes
    ----------
    name : str
        As in ``--filter``.
    cls : str
        Its class in the package.
    title : str
        As pages and pictures name it.
    processes, sensors : tuple of str
        Classes of the models that it takes.
    kernel, policy : bool
        Whether it takes a robust kernel, an interval policy.
    replay, chip, parity, budget : bool
        Whether ``auvest replay`` takes it; whether it is built for the vehicle; whether the parity
        tests show the same bits on every target; whether docs/budgets.md has what it costs there.
    note : str
        Why it is for the desk only, if it is.
    """

    name: str
    cls: str
    title: str
    processes: tuple[str, ...]
    sensors: tuple[str, ...]
    kernel: bool = False
    policy: bool = False
    replay: bool = False
    chip: bool = False
    parity: bool = False
    budget: bool = False
    note: str = ""

    def row(self) -> dict[str, Any]:
        """Give what ``auvest filters --json`` prints of it."""
        return {"name": self.name, "python": True, **asdict(self)}


def _gaussian(name: str, cls: str, title: str, **where: Any) -> Filter:
    return Filter(
        name=name,
        cls=cls,
        title=title,
        processes=_PROCESSES,
        sensors=_SENSORS,
        kernel=True,
        policy=True,
        **where,
    )


def _slat(name: str, cls: str, title: str, **where: Any) -> Filter:
    return Filter(
        name=name, cls=cls, title=title, processes=_MOTIONS, sensors=("Sonar",), **where
    )


FILTERS: dict[str, Filter] = {
    entry.name: entry
    for entry in (
        _gaussian("ekf", "Ekf", "EKF", replay=True, chip=True, parity=True, budget=True),
        _gaussian("ukf", "Ukf", "UKF", replay=True, chip=True, parity=True, budget=True),
        _gaussian("aukf", "Aukf", "AUKF", replay=True, chip=True, parity=True, budget=True),
        _gaussian(
            "robust-ekf", "RobustEkf", "robust EKF",
            replay=True, chip=True, parity=True, budget=True,
        ),
        _gaussian(
            "robust-ukf", "RobustUkf", "robust UKF", replay=True, note="no record of it is replayed"
        ),
        _slat("slatf1", "Slatf", "SLATF 1.0", chip=True, parity=True, budget=True),
        _slat("slatf2", "Slatf", "SLATF 2.0", chip=True, parity=True, budget=True),
        _slat("slatf-joint", "SlatfJoint", "SLATF, joint", note="no record of it is replayed"),
        _slat("ekf-slat", "EkfSlat", "EKF-SLAT", note="no record of it is replayed"),
        _slat(
            "dead-reckoning", "DeadReckoning", "dead reckoning",
            note="what the others are compared with",
        ),
    )
}  # fmt: skip


def filter_named(name: str, among: Iterable[str] | None = None) -> Filter:
    """Find a filter by its name.

    Parameters
    ----------
    name : str
        As in ``--filter``.
    among : iterable of str, optional
        The names that are allowed; default: all.

    Raises
    ------
    ValueError
        If there is no such filter; the message has the names that exist.
    """
    names = list(FILTERS if among is None else among)
    if name not in names:
        raise ValueError(f"filter must be {', '.join(names[:-1])} or {names[-1]}, not {name!r}")
    return FILTERS[name]


def replayable() -> list[str]:
    """Names of the filters that ``auvest replay`` takes."""
    return [entry.name for entry in FILTERS.values() if entry.replay]
