"""What can be wrong with a log: the vocabulary of causes, and a finding in a file.

``auvest check`` and ``auvest replay`` speak of nothing else; docs/logs.md has the same table.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

Verdict: TypeAlias = Literal["sound", "doubtful", "not_trusted"]

#: From good to bad.
VERDICTS: tuple[Verdict, ...] = ("sound", "doubtful", "not_trusted")

#: What is wrong, and the verdict that it alone brings; "sound" is a note.
CAUSES: Mapping[str, tuple[str, Verdict]] = {
    # what files show
    "unreadable": ("a file is missing, cut, or holds what is no number", "not_trusted"),
    "separator": ("cells are not parted by commas", "not_trusted"),
    "decimal_comma": ("numbers have a decimal comma", "not_trusted"),
    "milliseconds": ("times are in milliseconds", "not_trusted"),
    "microseconds": ("times are in microseconds", "not_trusted"),
    "millimetres": ("lengths or speeds are in millimetres", "not_trusted"),
    "degrees": ("angles are in degrees", "not_trusted"),
    "times_equal": ("the clock stands, or has lost its digits", "not_trusted"),
    "clock_jump": ("the clock jumps, forwards or back", "not_trusted"),
    "clocks_apart": ("files of one log have different clocks", "not_trusted"),
    "no_odometry": ("ranges, but no odometry", "not_trusted"),
    "no_measurements": ("no line of ranges or fixes", "not_trusted"),
    "odometry_gap": ("odometry pauses while the craft moves", "doubtful"),
    "no_echo": ("a value that stands for 'no echo' is logged as a range", "doubtful"),
    "ignored_file": ("a file that no log has is not read", "sound"),
    "ignored_column": ("a column that the file of a log has not is not read", "sound"),
    "ignored_settings": ("settings that such a log has no use for", "sound"),
    "local_origin": ("coordinates are far from (0, 0); an origin is subtracted", "sound"),
    "earth_origin": ("latitudes and longitudes count from the first of them", "sound"),
    # what the belief shows
    "not_converged": ("the ranges do not say where the craft is", "not_trusted"),
    "ambiguous": ("the ranges leave several places", "not_trusted"),
    "settling": ("the ranges leave one place, not yet confirmed", "doubtful"),
    "overconfident": ("particles were resampled so often that sigmas are too small", "sound"),
    # what innovations show
    "not_used": ("measurements that no filter was given", "doubtful"),
    "lengths_apart": ("ranges and positions differ in unit or origin", "not_trusted"),
    "start_off": ("the place, the heading or the time of the start is wrong", "doubtful"),
    "heading_mirrored": ("the heading, or a bearing, turns the wrong way", "not_trusted"),
    "heading_turned": ("the heading, or a bearing, counts from another axis", "not_trusted"),
    "axes_exchanged": ("x and y of the sources are exchanged (NED, ENU)", "not_trusted"),
    "slant_range": ("ranges are slant: source and craft differ in depth", "doubtful"),
    "latency": ("measurements carry the time of their arrival", "doubtful"),
    "range_scale": ("ranges are too long or too short by a factor", "doubtful"),
    "speed_scale": ("speeds or distances are in another unit, or off by a factor", "doubtful"),
    "source_off": ("one source fits no track that the others fit", "doubtful"),
    "noise_too_small": ("standard deviations in the settings are too small", "doubtful"),
    "recoveries": ("the filter lost its track again and again", "not_trusted"),
    "innovations": ("measurements do not fit, and no known cause explains it", "doubtful"),
}


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or worth a note.

    Attributes
    ----------
    cause : str
        One of :data:`CAUSES`.
    file : str
        Name of the file in the log's folder; "" if it is about the log as a whole.
    line : int or None
        Line of the file, counted from 1; None if it is about the file as a whole.
    message : str
        What was seen, with figures, and what it may be.
    verdict : str
        What it makes of the log: "sound" (a note), "doubtful" or "not_trusted".
    """

    cause: str
    file: str
    line: int | None
    message: str
    verdict: Verdict

    @property
    def text(self) -> str:
        """One line for people."""
        where = [self.file] * bool(self.file) + [f"line {self.line}"] * (self.line is not None)
        return f"{', '.join(where)}: {self.message}" if where else self.message

    def document(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "cause": self.cause,
            "file": self.file,
            "line": self.line,
            "message": self.message,
            "verdict": self.verdict,
        }


def finding(
    cause: str,
    message: str,
    *,
    file: str = "",
    line: int | None = None,
    verdict: Verdict | None = None,
) -> Finding:
    """Make a finding; without a verdict it has that of its cause."""
    return Finding(cause, file, line, message, verdict or CAUSES[cause][1])


def worst(verdicts: Iterable[Verdict]) -> Verdict:
    """Give the worst of them; of none "sound"."""
    return max(verdicts, key=VERDICTS.index, default="sound")
