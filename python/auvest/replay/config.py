"""Settings of a replay: what each section of the TOML file may say, with defaults and checks."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args, get_type_hints

from auvest import _core
from auvest._fields import flag, fraction, integer, not_negative, number, positive
from auvest._outputs import is_plain_file
from auvest.kernels import KERNELS, Kernel, RejectionStreak
from auvest.logs.layout import COLUMNS, FILES
from auvest.logs.reading import SEPARATORS, UNITS, Axes, FileReading, Reading, columns_of
from auvest.models import ConstantAcceleration

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

FilterName: TypeAlias = Literal[
    "ekf", "ukf", "ckf", "aukf", "robust-ekf", "robust-ukf",
    "slatf1", "slatf2", "slatf-joint", "ekf-slat",
]  # fmt: skip
KernelName: TypeAlias = Literal["huber", "hampel", "igg"]
ResidualName: TypeAlias = Literal["innovation", "post-fit"]
DiscretisationName: TypeAlias = Literal["exact", "euler"]
DTypeName: TypeAlias = Literal["float64", "float32"]
PolicyName: TypeAlias = Literal["fixed", "covariance-budget", "mahalanobis"]
BearingName: TypeAlias = Literal["from_heading", "slave_to_master", "master_to_slave"]
MasterName: TypeAlias = Literal["piecewise", "imm"]
ResamplingName: TypeAlias = Literal["systematic", "stratified", "residual", "multinomial"]
CovarianceName: TypeAlias = Literal["particle", "shared"]

_PACKAGED = Path(__file__).parent / "configs"
_KERNELS = _core.kernel_defaults()
_ROBUST = _core.robust_update_defaults()
_POINTS = _core.sigma_points_defaults()
_COMPASS = _core.compass_motion_defaults()
_UNICYCLE = _core.unicycle_motion_defaults()
_SONAR = _core.sonar_defaults()
_PIECEWISE = _core.piecewise_acceleration_defaults()
_IMM = _core.imm_defaults()
_ACCELERATED = ConstantAcceleration()
_SLATF = _core.slatf_defaults()
_MOST = 2**64 - 1


@dataclass(frozen=True, kw_only=True)
class FilterSettings:
    """The filter.

    ``kernel``, ``recovery``, ``rejections``, ``residual``, ``max_iterations`` and ``tolerance`` are
    those of the robust ones, ``alpha``, ``beta`` and ``kappa`` of those with sigma points.
    ``components`` above 1 are for ranges from a start that is not known, ``headings`` above 1 for
    one whose heading is not known either.
    """

    # default: robust-ekf with odometry, ukf without, slatf-joint with echoes
    kind: FilterName | None = None
    kernel: KernelName = "hampel"  # its thresholds are in [kernel]
    recovery: bool = flag(True)  # from lock-out
    rejections: int = integer(_ROBUST["rejections"], 1, 60)  # in a row, until it acts
    residual: ResidualName = "innovation"  # what the kernel judges
    max_iterations: int = integer(_ROBUST["max_iterations"], 2, 255)  # of post-fit
    tolerance: float = not_negative(_ROBUST["tolerance"])  # of post-fit
    alpha: float = positive(1e-3)  # spread of the sigma points
    beta: float = number(_POINTS["beta"])
    kappa: float | None = number(None)  # default: 3 minus the number of states
    dtype: DTypeName = "float64"  # float32: the bits of the filter on the vehicle
    longest_step_s: float = positive(3600.0, infinite=True)  # a longer gap is refused
    components: int = integer(1, 1, 255)  # 16 to 32 for a start that is not known
    headings: int = integer(1, 1, 31)  # so many start headings, of 8 components each at least


@dataclass(frozen=True, kw_only=True)
class KernelSettings:
    """Thresholds of the kernels in sigma; those of the one that is chosen count."""

    a: float = positive(_KERNELS["hampel"]["a"], infinite=True)  # hampel: full weight below
    b: float = positive(_KERNELS["hampel"]["b"], infinite=True)  # hampel: falls from here
    c: float = positive(_KERNELS["hampel"]["c"], infinite=True)  # hampel: rejected from here
    k: float = positive(_KERNELS["huber"]["k"], infinite=True)  # huber
    k0: float = positive(_KERNELS["igg"]["k0"], infinite=True)  # igg: full weight below
    k1: float = positive(_KERNELS["igg"]["k1"], infinite=True)  # igg: rejected from here


@dataclass(frozen=True, kw_only=True)
class StartSettings:
    """Standard deviations of the belief that the run starts with.

    Filters that hear echoes take 0 for a pose that is known.
    """

    sigma_position_m: float = not_negative(1.0)
    sigma_heading_rad: float = not_negative(0.1)
    sigma_speed_m_s: float = positive(0.5)
    sigma_acceleration_m_s2: float = positive(0.1)


@dataclass(frozen=True, kw_only=True)
class OdometrySettings:
    """Noise of the odometry, and its calibration: factors on speed and turn, then an offset."""

    sigma_distance: float = not_negative(0.05)  # of the distance of one increment
    sigma_drift: float = not_negative(0.1)  # m/sqrt(s)
    sigma_turn: float = not_negative(0.001)  # rad/sqrt(s)
    sigma_turned: float = not_negative(0.0)  # of the turn of one increment
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
class ConstantSettings:
    """What instruments are off by, found with the pose: what is known before; 0: not looked for."""

    range_scale: float = not_negative(0.0)  # ranges are 1 + it times the distance, plus the next
    range_offset_m: float = not_negative(0.0)  # of all sources that have none of their own
    speed_factor: float = not_negative(0.0)  # what is to be added to that of [odometry]
    turn_offset_rad_s: float = not_negative(0.0)  # likewise
    compass_offset_rad: float = not_negative(0.0)  # likewise to that of [compass]
    walk: float = not_negative(0.0)  # so much of each in an hour


@dataclass(frozen=True, kw_only=True)
class RangeSource:
    """One source of ranges, where it differs from the others."""

    sigma_m: float | None = positive(None)
    latency_s: float | None = not_negative(None)
    constant_offset_m: float | None = positive(None)  # an offset of its own, as of [constants]


@dataclass(frozen=True, kw_only=True)
class RangeSettings:
    """Ranges: noise, the least time between two of one source that are used, latency."""

    sigma_m: float = positive(1.0)
    every_s: float = not_negative(0.0)  # least time between two of one source
    latency_s: float = not_negative(0.0)  # a line stands when its range came in, so long after
    smallest_m: float = number(0.0)  # what the instrument can measure
    largest_m: float = positive(math.inf, infinite=True)
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
    near_field: float = not_negative(5.0)  # sigma of the position: nearer is a position
    smallest_m: float = number(0.0)
    largest_m: float = positive(math.inf, infinite=True)
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
class WaterSettings:
    """Where water.csv tells the speed of sound: what the instrument took, and what is not told."""

    assumed_m_s: float = positive(1500.0)  # by which the ranges were made
    salinity_psu: float = not_negative(35.0)  # where the file has none


@dataclass(frozen=True, kw_only=True)
class ProcessSettings:
    """Driving noise of a tracked craft, as of :class:`auvest.ConstantAcceleration`.

    With elevations or depths that of :class:`auvest.WhiteAcceleration`: both ``velocity_psd``.
    """

    position_psd: float = not_negative(0.0)
    velocity_psd: float = not_negative(1e-2)
    acceleration_psd: float = not_negative(1e-6)
    vertical_velocity_psd: float = not_negative(1e-3)  # in space
    discretisation: DiscretisationName = "exact"  # euler: as the AUKF paper prints it


@dataclass(frozen=True, kw_only=True)
class IntervalSettings:
    """When aukf wants its next fix."""

    policy: PolicyName = "covariance-budget"
    interval_s: float = positive(5.0)  # of fixed
    min_s: float = positive(0.5)
    max_s: float = positive(10.0)
    position_sigma_m: float = positive(0.5)  # of covariance-budget
    initial_s: float | None = positive(None)  # default: min_s
    tau0: float | None = positive(
        None
    )  # this and what follows: mahalanobis, by default the paper's
    scale: float | None = positive(None)
    epsilon: float | None = positive(None)
    gamma1_m2: float | None = positive(None)
    gamma2: float | None = positive(None)
    ratio_max: float | None = positive(None)
    tau_min: float | None = positive(None)
    tau_max: float | None = positive(None)


@dataclass(frozen=True, kw_only=True)
class SonarSettings:
    """Echoes of masters, as of :class:`auvest.Sonar`."""

    sigma_range_m: float = positive(_SONAR["sigma_range_m"])
    sigma_bearing_rad: float = positive(_SONAR["sigma_bearing_rad"])
    bearing: BearingName | None = None  # default: from_heading with turns, else slave_to_master
    smallest_m: float = number(_SONAR["smallest_range_m"])
    largest_m: float = positive(math.inf, infinite=True)


@dataclass(frozen=True, kw_only=True)
class SlaveSettings:
    """What a slave that hears echoes reads of its own motion: noise of one reading."""

    sigma_speed_m_s: float | None = not_negative(None)  # default: that of the motion
    sigma_heading_rad: float = not_negative(_COMPASS["sigma_heading_rad"])  # of speed and heading
    sigma_yaw_rate_rad_s: float = not_negative(_UNICYCLE["sigma_yaw_rate_rad_s"])
    compensate_bias: bool = flag(_COMPASS["compensate_bias"])  # of a noisy heading
    mean_s: float = not_negative(0.0)  # readings are means over so long; 0: each line is one


@dataclass(frozen=True, kw_only=True)
class MastersSettings:
    """How masters move, and what is not known of one that is met."""

    model: MasterName = "piecewise"
    sigma_m: float = positive(1.0)  # where masters.csv does not say
    sigma_velocity_m_s: float = positive(0.05)  # and of one that is known by its first echo
    sigma_acceleration_m_s2: float = positive(0.01)
    acceleration_m_s2: float = not_negative(_PIECEWISE["acceleration_m_s2"])  # of piecewise
    position_psd: float = not_negative(_PIECEWISE["position_psd"])  # of piecewise
    straight_velocity_psd: float = not_negative(_IMM["straight"]["velocity_psd"])  # of imm, as all
    straight_sigma_acceleration_m_s2: float = not_negative(
        _IMM["straight"]["sigma_acceleration_m_s2"]
    )
    accelerated_position_psd: float = not_negative(_ACCELERATED.position_psd)
    accelerated_velocity_psd: float = not_negative(_ACCELERATED.velocity_psd)
    accelerated_acceleration_psd: float = not_negative(_ACCELERATED.acceleration_psd)
    turning_position_psd: float = not_negative(_IMM["turning"]["position_psd"])
    turning_velocity_psd: float = not_negative(_IMM["turning"]["velocity_psd"])
    turning_acceleration_psd: float = not_negative(_IMM["turning"]["acceleration_psd"])
    turning_slow_m_s: float = positive(_IMM["turning"]["slow_m_s"])
    share_straight: float = fraction(1 / 3)  # of the time; the three have the sum 1
    share_accelerated: float = fraction(1 / 3)
    share_turning: float = fraction(1 / 3)
    switch_rate_hz: float = not_negative(_IMM["switch_rate_hz"])


@dataclass(frozen=True, kw_only=True)
class SlatSettings:
    """Filters that hear echoes, as of :class:`auvest.Slatf` and its like."""

    particles: int = integer(100, 1, 10_000_000)
    seed: int = integer(1, 0, _MOST)
    stream: int = integer(0, 0, _MOST)
    resampling: ResamplingName = "systematic"
    resample_below: float = fraction(_SLATF["resample_below"])
    monte_carlo: bool = flag(_SLATF["monte_carlo"])  # slatf1, slatf2
    carry_covariance: bool = flag(_SLATF["carry_covariance"])  # slatf2
    birth_velocity_m_s: float = not_negative(_SLATF["birth_velocity_m_s"])  # slatf1, slatf2
    birth_acceleration_m_s2: float = positive(_SLATF["birth_acceleration_m_s2"])
    covariance: CovarianceName = "particle"  # slatf-joint
    kept: float | None = not_negative(None)  # slatf-joint; default: that of the covariance
    max_masters: int = integer(1, 1, _core.slat_max_masters)  # slatf-joint
    consider: bool = flag(False)  # ekf-slat
    gate: float = not_negative(_SLATF["gate"])  # NIS beyond which an echo says nothing; 0: no gate
    recover_after: int = integer(_SLATF["recover_after"], 0, 16)
    recover_of: int = integer(_SLATF["recover_of"], 0, 16)
    fastest_m_s: float = not_negative(_SLATF["fastest_m_s"])
    forget_after_s: float = not_negative(_SLATF["forget_after_s"])
    rebirth_velocity_m_s: float = positive(_SLATF["rebirth_velocity_m_s"])
    rebirth_acceleration_m_s2: float = positive(_SLATF["rebirth_acceleration_m_s2"])


@dataclass(frozen=True, kw_only=True)
class LogSettings:
    """Axes, window for late lines, longest gap in a leader's track that a line bridges."""

    frame: Axes = "enu"  # x east, y north; ned: x north, y east
    reorder_s: float = not_negative(0.0)
    leader_gap_s: float = not_negative(1.0)  # with echoes also of the truth


@dataclass(frozen=True, kw_only=True)
class Settings:
    """All sections; ``files`` is what [columns] and [units] say, by the names of a log's files."""

    filter: FilterSettings = FilterSettings()
    kernel: KernelSettings = KernelSettings()
    start: StartSettings = StartSettings()
    odometry: OdometrySettings = OdometrySettings()
    compass: CompassSettings = CompassSettings()
    constants: ConstantSettings = ConstantSettings()
    ranges: RangeSettings = RangeSettings()
    fixes: FixSettings = FixSettings()
    positions: PositionSettings = PositionSettings()
    velocities: VelocitySettings = VelocitySettings()
    depth: DepthSettings = DepthSettings()
    water: WaterSettings = WaterSettings()
    process: ProcessSettings = ProcessSettings()
    interval: IntervalSettings = IntervalSettings()
    sonar: SonarSettings = SonarSettings()
    slave: SlaveSettings = SlaveSettings()
    masters: MastersSettings = MastersSettings()
    slat: SlatSettings = SlatSettings()
    log: LogSettings = LogSettings()
    files: Mapping[str, FileReading] = field(default_factory=dict)

    @property
    def reading(self) -> Reading:
        """How a log is read with them."""
        return Reading(frame=self.log.frame, files=self.files)

    @property
    def robust(self) -> tuple[Kernel, RejectionStreak | None]:
        """Kernel and recovery of a robust filter.

        Raises
        ------
        ValueError
            If the thresholds do not fit together.
        """
        kind = KERNELS[self.filter.kernel]
        own = {entry.name: getattr(self.kernel, entry.name) for entry in fields(kind)}
        streak = RejectionStreak(rejections=self.filter.rejections)
        return kind(**own), streak if self.filter.recovery else None


#: What [columns.FILE] says beside columns, and the values that it may have.
FILE_KEYS: Mapping[str, tuple[str, ...]] = {
    "file": (),
    "separator": SEPARATORS,
    "decimal": (".", ","),
}


def packaged_settings() -> tuple[str, ...]:
    """Names of the settings that come with the package, one per validation set."""
    return tuple(sorted(path.stem for path in _PACKAGED.glob("*.toml")))


def find_settings(name: str, changes: Sequence[str] = ()) -> Settings:
    """Read settings from a file, or those that come with the package, by name.

    Parameters
    ----------
    name : str
        The file, or one of :func:`packaged_settings`; "" for the defaults.
    changes : sequence of str
        ``section.key=value``, over what the file says.

    Raises
    ------
    ValueError
        As :func:`read_settings`.
    """
    if not name:
        return _changed({}, changes, "settings")
    path = Path(name)
    if not path.exists():
        if name not in packaged_settings():
            known = ", ".join(packaged_settings())
            raise ValueError(f"{name}: there is no such file; the package's settings are {known}")
        path = _PACKAGED / f"{name}.toml"
    return _changed(_document(path), changes, str(path))


def read_settings(path: Path) -> Settings:
    """Read a TOML file; a section or a key that is left out has its default.

    Raises
    ------
    ValueError
        If the file cannot be read, is not TOML, or says something that is not known or out of
        range; the message names file, section and key.
    """
    return settings_from(_document(path), str(path))


def _document(path: Path) -> dict[str, Any]:
    try:
        if path.exists() and not is_plain_file(path):
            raise ValueError(f"{path}: is not a file")
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: is not TOML: {error}") from None
    except RecursionError:
        raise ValueError(f"{path}: is not TOML: brackets in brackets without end") from None


def _changed(document: dict[str, Any], changes: Sequence[str], source: str) -> Settings:
    """Build settings from a document with ``section.key=value`` over it."""
    for change in changes:
        path, equals, text = change.partition("=")
        *sections, key = path.strip().split(".")
        if not equals or not sections:
            raise ValueError(f"--set: {change!r} is not SECTION.KEY=VALUE")
        try:
            value = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            value = text.strip()  # a word without quotes
        at = document
        for section in sections:
            at = at.setdefault(section, {})
            if not isinstance(at, dict):
                raise ValueError(f"--set: {path.strip()}: {section} is no section")
        at[key] = value
        source = f"{source} with --set" if not source.endswith("--set") else source
    return settings_from(document, source)


def settings_from(document: dict[str, Any], source: str = "settings") -> Settings:
    """Build settings from nested dicts; ``source`` is named in messages.

    Raises
    ------
    ValueError
        As :func:`read_settings`.
    """
    sections = get_type_hints(Settings)
    del sections["files"]
    _refuse_unknown(document, [*sections, "columns", "units"], source)
    chosen = {}
    for name, values in document.items():
        where = f"{source}: [{name}]"
        if not isinstance(values, dict):
            raise ValueError(f"{where} must be a section")
        if name in sections:
            chosen[name] = _section(sections[name], values, where)
    chosen["files"] = _files(document.get("columns", {}), document.get("units", {}), source)
    settings = Settings(**chosen)
    try:
        settings.robust  # noqa: B018  (thresholds that do not fit are refused here)
    except ValueError as error:
        raise ValueError(f"{source}: [kernel] {error}") from None
    return settings


def _files(columns: dict[str, Any], units: dict[str, Any], source: str) -> dict[str, FileReading]:
    """Take what [columns] and [units] say of files that are not as docs/logs.md has them."""
    stems = {name.removesuffix(".csv"): name for name in FILES}
    made: dict[str, FileReading] = {}
    for section, said in (("columns", columns), ("units", units)):
        _refuse_unknown(said, stems, f"{source}: [{section}]")
        for stem, values in said.items():
            where = f"{source}: [{section}.{stem}]"
            if not isinstance(values, dict):
                raise ValueError(f"{where} must be a section")
            known = columns_of(stems[stem])
            given = dict(values)
            options: dict[str, Any] = {}
            if section == "columns":
                options = {key: given.pop(key) for key in FILE_KEYS if key in given}
                for key, value in options.items():
                    _choose(FILE_KEYS[key], value, f"{where} {key}")
            _refuse_unknown(given, known, where)
            for column, value in given.items():
                if section == "columns":
                    _choose((), value, f"{where} {column}")
                else:
                    kinds = tuple(UNITS.get(COLUMNS[column].unit, {}))
                    if not kinds:
                        raise ValueError(f"{where} {column} has no unit")
                    _choose(kinds, value, f"{where} {column}")
            before = made.get(stems[stem], FileReading(where=where))
            changed: dict[str, Any] = {section: given, **options}
            if section == "units":
                changed["units_where"] = where
            made[stems[stem]] = replace(before, **changed)
    return made


def _choose(kinds: tuple[str, ...], value: object, where: str) -> None:
    if not isinstance(value, str) or not value:
        raise ValueError(f"{where} must be a text, not {value!r}")
    if kinds and value not in kinds:
        raise ValueError(f"{where} must be one of {', '.join(map(repr, kinds))}, not {value!r}")


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
