"""Settings of a replay: what each section of the TOML file may say, with defaults and checks."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args, get_type_hints

from auvest._fields import integer, not_negative, number, positive
from auvest._outputs import is_plain_file

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

FilterName: TypeAlias = Literal["ekf", "ukf", "ckf", "aukf", "robust-ekf", "robust-ukf"]
KernelName: TypeAlias = Literal["huber", "hampel", "igg"]
PolicyName: TypeAlias = Literal["fixed", "covariance-budget", "mahalanobis"]

_PACKAGED = Path(__file__).parent / "configs"


@dataclass(frozen=True, kw_only=True)
class FilterSettings:
    """The filter: ``kernel``, ``rejections`` and ``residual`` are those of robust-ekf.

    ``components`` above 1 are for ranges from a start that is not known, ``headings`` above 1 for
    one whose heading is not known either.
    """

    kind: FilterName | None = None  # None: robust-ekf for ranges, ukf for fixes
    kernel: KernelName = "hampel"  # with the thresholds that are its defaults
    alpha: float = positive(1e-3)
    longest_step_s: float = positive(3600.0, infinite=True)
    components: int = integer(1, 1, 255)  # 16 to 32 for a start that is not known
    headings: int = integer(1, 1, 31)  # so many start headings, of 8 components each at least


@dataclass(frozen=True, kw_only=True)
class StartSettings:
    """Standard deviations of the belief that the run starts with."""

    sigma_position_m: float = positive(1.0)
    sigma_heading_rad: float = positive(0.1)
    sigma_speed_m_s: float = positive(0.5)
    sigma_acceleration_m_s2: float = positive(0.1)


@dataclass(frozen=True, kw_only=True)
class OdometrySettings:
    """Noise of the odometry, and its calibration: factors on speed and turn, then an offset."""

    sigma_distance: float = not_negative(0.05)  # of the distance of one increment
    sigma_drift: float = not_negative(0.1)  # m/sqrt(s)
    sigma_turn: float = not_negative(0.001)  # rad/sqrt(s)
    speed_factor: float = positive(1.0)
    turn_factor: float = positive(1.0)
    turn_offset_rad_s: float = number(0.0)
    max_step_s: float = positive(0.1)  # of velocity odometry
    gap_s: float = positive(15.0)  # a velocity holds no longer
    latency_s: float = not_negative(0.0)  # lines stand so long after their motion


@dataclass(frozen=True, kw_only=True)
class CompassSettings:
    """Compass: what is added to its headings, and how long before their times they were taken."""

    offset_rad: float = number(0.0)  # declination and misalignment, from +x towards +y
    latency_s: float = not_negative(0.0)


@dataclass(frozen=True, kw_only=True)
class RangeSource:
    """One source of ranges, where it differs from the others."""

    sigma_m: float | None = positive(None)
    latency_s: float | None = not_negative(None)


@dataclass(frozen=True, kw_only=True)
class RangeSettings:
    """Ranges: noise, the least time between two of one source that are used, latency."""

    sigma_m: float = positive(1.0)
    every_s: float = not_negative(0.0)
    latency_s: float = not_negative(0.0)  # a line stands when its range came in, so long after
    sources: Mapping[int, RangeSource] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class FixSource:
    """One station, where it differs from the others."""

    sigma_range_m: float | None = positive(None)
    sigma_bearing_rad: float | None = positive(None)
    sigma_elevation_rad: float | None = positive(None)
    latency_s: float | None = not_negative(None)


@dataclass(frozen=True, kw_only=True)
class FixSettings:
    """Fixes by range and bearing: noise, the least time between two that are used, latency."""

    sigma_range_m: float = positive(0.1)
    sigma_bearing_rad: float = positive(0.02)
    sigma_elevation_rad: float = positive(0.02)
    near_field: float = not_negative(5.0)
    every_s: float = not_negative(0.0)
    latency_s: float = not_negative(0.0)
    sources: Mapping[int, FixSource] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class PositionSettings:
    """Absolute positions: noise where positions.csv has none, thinning, latency."""

    sigma_m: float = positive(1.0)
    sigma_depth_m: float = positive(1.0)
    every_s: float = not_negative(0.0)
    latency_s: float = not_negative(0.0)


@dataclass(frozen=True, kw_only=True)
class VelocitySettings:
    """Velocities of a tracked craft: noise and latency."""

    sigma_forward_m_s: float = positive(0.05)
    sigma_left_m_s: float = positive(0.05)
    sigma_down_m_s: float = positive(0.05)
    latency_s: float = not_negative(0.0)


@dataclass(frozen=True, kw_only=True)
class DepthSettings:
    """Depths: noise, where they are measured, and latency."""

    sigma_m: float = positive(0.1)
    latency_s: float = not_negative(0.0)


@dataclass(frozen=True, kw_only=True)
class ProcessSettings:
    """Driving noise of a tracked craft, as of :class:`auvest.ConstantAcceleration`.

    With elevations or depths that of :class:`auvest.WhiteAcceleration`: both ``velocity_psd``.
    """

    position_psd: float = not_negative(0.0)
    velocity_psd: float = not_negative(1e-2)
    acceleration_psd: float = not_negative(1e-6)
    vertical_velocity_psd: float = not_negative(1e-3)


@dataclass(frozen=True, kw_only=True)
class IntervalSettings:
    """When aukf wants its next fix."""

    policy: PolicyName = "covariance-budget"
    interval_s: float = positive(5.0)  # of fixed
    min_s: float = positive(0.5)
    max_s: float = positive(10.0)
    position_sigma_m: float = positive(0.5)  # of covariance-budget


@dataclass(frozen=True, kw_only=True)
class LogSettings:
    """Window for late lines, and the longest gap in a leader's track that a line bridges."""

    reorder_s: float = not_negative(0.0)
    leader_gap_s: float = not_negative(1.0)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """All sections."""

    filter: FilterSettings = FilterSettings()
    start: StartSettings = StartSettings()
    odometry: OdometrySettings = OdometrySettings()
    compass: CompassSettings = CompassSettings()
    ranges: RangeSettings = RangeSettings()
    fixes: FixSettings = FixSettings()
    positions: PositionSettings = PositionSettings()
    velocities: VelocitySettings = VelocitySettings()
    depth: DepthSettings = DepthSettings()
    process: ProcessSettings = ProcessSettings()
    interval: IntervalSettings = IntervalSettings()
    log: LogSettings = LogSettings()


def packaged_settings() -> tuple[str, ...]:
    """Names of the settings that come with the package, one per validation set."""
    return tuple(sorted(path.stem for path in _PACKAGED.glob("*.toml")))


def find_settings(name: str) -> Settings:
    """Read settings from a file, or those that come with the package, by name.

    Raises
    ------
    ValueError
        As :func:`read_settings`.
    """
    path = Path(name)
    if not path.exists():
        if name not in packaged_settings():
            known = ", ".join(packaged_settings())
            raise ValueError(f"{name}: there is no such file; the package's settings are {known}")
        path = _PACKAGED / f"{name}.toml"
    return read_settings(path)


def read_settings(path: Path) -> Settings:
    """Read a TOML file; a section or a key that is left out has its default.

    Raises
    ------
    ValueError
        If the file cannot be read, is not TOML, or says something that is not known or out of
        range; the message names file, section and key.
    """
    try:
        if path.exists() and not is_plain_file(path):
            raise ValueError(f"{path}: is not a file")
        document = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: is not TOML: {error}") from None
    except RecursionError:
        raise ValueError(f"{path}: is not TOML: brackets in brackets without end") from None
    return settings_from(document, str(path))


def settings_from(document: dict[str, Any], source: str = "settings") -> Settings:
    """Build settings from nested dicts; ``source`` is named in messages.

    Raises
    ------
    ValueError
        As :func:`read_settings`.
    """
    sections = get_type_hints(Settings)
    _refuse_unknown(document, sections, source)
    chosen = {}
    for name, values in document.items():
        where = f"{source}: [{name}]"
        if not isinstance(values, dict):
            raise ValueError(f"{where} must be a section")
        chosen[name] = _section(sections[name], values, where)
    return Settings(**chosen)


def _section(kind: type[Any], values: dict[str, Any], where: str) -> Any:
    known = {entry.name: entry for entry in fields(kind)}
    _refuse_unknown(values, known, where)
    types = get_type_hints(kind)
    checked: dict[str, Any] = {}
    for key, value in values.items():
        if key == "sources":
            checked[key] = _sources(types[key], value, f"{where[:-1]}.sources")
        elif "take" in known[key].metadata:
            try:
                checked[key] = known[key].metadata["take"](key, value)
            except (ValueError, TypeError) as error:
                raise ValueError(f"{where} {error}") from None
        else:
            checked[key] = _choice(types[key], value, f"{where} {key}")
    return kind(**checked)


def _sources(kind: Any, given: object, where: str) -> dict[int, Any]:
    """Take what is said of single sources, by their numbers."""
    if not isinstance(given, dict):
        raise ValueError(f"{where}] must be a section")
    _, one = get_args(kind)
    chosen = {}
    for number_, values in given.items():
        if not number_.isdecimal() or not isinstance(values, dict):
            raise ValueError(f"{where}.{number_}] must be a section named by a source's number")
        chosen[int(number_)] = _section(one, values, f"{where}.{number_}]")
    return chosen


def _choice(kind: Any, value: object, where: str) -> object:
    options = [name for part in (kind, *get_args(kind)) for name in get_args(part)]
    names = [name for name in options if isinstance(name, str)] or list(get_args(kind))
    if value not in names:
        raise ValueError(f"{where} must be one of {', '.join(map(repr, names))}, not {value!r}")
    return value


def _refuse_unknown(values: dict[str, Any], known: Any, where: str) -> None:
    for key in values:
        if key not in known:
            raise ValueError(f"{where} has no {key!r}; known are {', '.join(known)}")
