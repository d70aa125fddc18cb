"""Which filters there are, with which models, and where each runs.

One line per filter: everything that lists filters reads it (``--filter`` of the commands, the table
of ``auvest filters``, the tests of parity and budgets, which fail where a line and a measurement
disagree).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal


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
    family : {"gaussian", "slat"}
        The Kalman filters take any process and sensor, a robust kernel, an interval policy and, for
        ranges from a start that is not known, several components; those that localise and track
        take a motion and a sonar.
    replay, chip, parity, budget : bool
        Whether ``auvest replay`` takes it; whether it is built for the vehicle; whether the parity
        tests show the same bits on every target; whether docs/budgets.md has what it costs there.
    note : str
        Why it is for the desk only, if it is; or what of it does not run everywhere.
    """

    name: str
    cls: str
    title: str
    family: Literal["gaussian", "slat"]
    replay: bool = False
    chip: bool = False
    parity: bool = False
    budget: bool = False
    note: str = ""

    def row(self) -> dict[str, Any]:
        """Give what ``auvest filters --json`` prints of it."""
        return {
            "name": self.name,
            "class": self.cls,
            "title": self.title,
            "python": True,
            "replay": self.replay,
            "chip": self.chip,
            "parity": self.parity,
            "budget": self.budget,
            "processes": self.processes,
            "sensors": self.sensors,
            "kernel": self.family == "gaussian",
            "policy": self.family == "gaussian",
            "components": self.family == "gaussian",
            "note": self.note,
        }

    @property
    def processes(self) -> list[str]:
        """Classes of the processes that it takes."""
        if self.family == "slat":
            return ["CompassMotion", "UnicycleMotion"]
        from auvest.models import PROCESSES

        return sorted(PROCESSES)

    @property
    def sensors(self) -> list[str]:
        """Classes of the sensors that it takes."""
        if self.family == "slat":
            return ["Sonar"]
        from auvest.models import SENSORS

        return sorted(SENSORS)


_EVERYWHERE = {"chip": True, "parity": True, "budget": True}
_IMM_TOO_LARGE = "with an Imm not on the ATmega2560: 16 particles take more than 7 of its 8 KB"
_SLATF = {"replay": True, **_EVERYWHERE, "note": _IMM_TOO_LARGE}

FILTERS: dict[str, Filter] = {
    name: Filter(name=name, cls=cls, title=title, family=family, **where)  # type: ignore[arg-type]
    for name, cls, title, family, where in (
        ("ekf", "Ekf", "EKF", "gaussian", {"replay": True, **_EVERYWHERE}),
        ("ukf", "Ukf", "UKF", "gaussian", {"replay": True, **_EVERYWHERE}),
        ("ckf", "Ckf", "CKF", "gaussian", {"replay": True, **_EVERYWHERE}),
        ("aukf", "Aukf", "AUKF", "gaussian", {"replay": True, **_EVERYWHERE}),
        ("robust-ekf", "RobustEkf", "robust EKF", "gaussian", {"replay": True, **_EVERYWHERE}),
        ("robust-ukf", "RobustUkf", "robust UKF", "gaussian", {"replay": True, **_EVERYWHERE}),
        ("slatf1", "Slatf", "SLATF 1.0", "slat", _SLATF),
        ("slatf2", "Slatf", "SLATF 2.0", "slat", _SLATF),
        ("slatf-joint", "SlatfJoint", "SLATF, joint", "slat", {"replay": True, **_EVERYWHERE}),
        ("ekf-slat", "EkfSlat", "EKF-SLAT", "slat", {"replay": True, **_EVERYWHERE}),
        (
            "dead-reckoning", "DeadReckoning", "dead reckoning", "slat",
            {"note": "what the others are compared with"},
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
        from auvest._texts import either  # here, because --help needs none of it

        raise ValueError(f"filter must be {either(names)}, not {name!r}")
    return FILTERS[name]


def replayable() -> list[str]:
    """Names of the filters that ``auvest replay`` takes."""
    return [entry.name for entry in FILTERS.values() if entry.replay]
