"""Options that mean the same in every command, and checks of option values."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from auvest.simulation.paper_aukf import DTypeName, NoiseKind

# Panels of --help.
FILTER = "Filter"
WORLD = "World"
MONTE_CARLO = "Monte Carlo"
_OUTPUT = "Output"


def refuse_given(ctx: typer.Context, names: tuple[str, ...], why: str) -> None:
    """Refuse options that were given and would do nothing."""
    for name in names:
        source = ctx.get_parameter_source(name)
        if source is not None and source.name != "DEFAULT":
            raise typer.BadParameter(why, param_hint=f"'--{name.replace('_', '-')}'")


def one_board(port: str | None, simulator: Path | None) -> None:
    """Refuse to run on no board, and on two."""
    if (port is None) == (simulator is None):
        raise typer.BadParameter("give one of the two.", param_hint="'--port' / '--simulator'")


def _check(holds: Callable[[float], bool], expected: str) -> Callable[[float | None], float | None]:
    """Make an option callback: the number, if one was given, must be what is expected."""

    def check(value: float | None) -> float | None:
        if value is not None and not holds(value):
            raise typer.BadParameter(f"{value} is not {expected}.")
        return value

    return check


finite = _check(math.isfinite, "a finite number")
positive = _check(lambda value: 0 < value < math.inf, "a finite number above 0")
not_negative = _check(lambda value: 0 <= value < math.inf, "a finite number of at least 0")
fraction = _check(lambda value: 0 <= value < 1, "a probability of at least 0 and below 1")
open_unit = _check(lambda value: 0 < value < 1, "strictly between 0 and 1")


def option(
    panel: str,
    text: str,
    *names: str,
    check: Callable[[Any], Any] | None = None,
    **more: Any,
) -> Any:
    """Describe an option: its panel of --help, its help, its names if not the parameter's."""
    return typer.Option(*names, callback=check, help=text, rich_help_panel=panel, **more)


Runs = Annotated[
    int, typer.Option("--runs", min=1, max=100_000, help="Monte Carlo runs.", show_default=True)
]
#: Runs of a command that keeps many simulations in memory at once.
PageRuns = Annotated[
    int, typer.Option("--runs", min=1, max=2000, help="Monte Carlo runs.", show_default=True)
]
Seed = Annotated[
    int,
    typer.Option(
        "--seed",
        min=0,
        max=2**64 - 1,
        help="Seed: the same seed gives the same numbers, whatever the number of workers.",
    ),
]
Workers = Annotated[
    int | None,
    typer.Option("--workers", min=1, max=256, help="Threads.", show_default="one per processor"),
]
Json = Annotated[bool, option(_OUTPUT, "One JSON object on stdout, nothing else.", "--json")]
Quiet = Annotated[bool, option(_OUTPUT, "Only errors on stderr.", "--quiet", "-q")]
Output = Annotated[
    Path,
    option(
        _OUTPUT,
        "Folder for the results, which replace those of the same command before.",
        "--output",
        file_okay=False,
    ),
]
#: Recordings are not part of the package.
Data = Annotated[
    Path,
    typer.Option(
        "--data",
        envvar="AUVEST_DATA",
        file_okay=False,
        help="Folder of the recordings.",
        show_default=False,
    ),
]
OptionalData = Annotated[
    Path | None,
    typer.Option(
        "--data",
        envvar="AUVEST_DATA",
        file_okay=False,
        help="Folder of the recordings.",
        show_default="none are taken",
    ),
]
Force = Annotated[
    bool,
    option(
        _OUTPUT,
        "Replace the results of another command in --output; set aside what is not auvest's.",
        "--force",
    ),
]
NoFigure = Annotated[bool, option(_OUTPUT, "Draw nothing.", "--no-figure")]
Precision = Annotated[
    DTypeName, option(FILTER, "Precision; float32 gives the bits of the vehicle.", "--dtype")
]

# The noise of the AUKF paper's scenario: `simulate aukf` and `capture`.
Noise = Annotated[
    NoiseKind, option(WORLD, "Kind of both noises: U(0,1), N(0,1) or exp(N(0,1)).", "--noise")
]
RangeNoise = Annotated[
    float, option(WORLD, "Scale of the range noise, m.", "--range-noise", check=positive)
]
BearingNoise = Annotated[
    float, option(WORLD, "Scale of the bearing noise, rad.", "--bearing-noise", check=positive)
]

# The board that runs a sketch: `capture` and `mission`.
Port = Annotated[
    str | None,
    typer.Option("--port", help="Serial port of the board, like /dev/ttyACM0 or COM3."),
]
Baud = Annotated[int, typer.Option("--baud", min=300, help="Baud rate of --port.")]
Simulator = Annotated[
    Path | None,
    typer.Option(
        "--simulator",
        exists=True,
        dir_okay=False,
        help="The compiled sketch (.elf), run on a simulated board.",
    ),
]

# The sea and the fixes of a mission: `simulate mission` and `mission`.
Current = Annotated[
    float, option(WORLD, "Speed of the current, m/s.", "--current", check=not_negative)
]
CurrentDirection = Annotated[
    float | None,
    option(
        WORLD,
        "Where it flows to, degrees from north; default: drawn for each run.",
        "--current-direction",
        check=finite,
    ),
]
FixOutliers = Annotated[float, option(WORLD, "Share of late ranges.", "--outliers", check=fraction)]
FixLatency = Annotated[float, option(WORLD, "Delay of a fix, s.", "--latency", check=not_negative)]
FixDropout = Annotated[
    float, option(WORLD, "Share of fixes that are lost.", "--dropout", check=fraction)
]
CompassBias = Annotated[
    float, option(WORLD, "Its standard deviation, degrees.", "--compass-bias", check=not_negative)
]


def sea(
    current: float,
    direction: float | None,
    compass_bias: float,
    outliers: float,
    latency: float,
    dropout: float,
) -> dict[str, float]:
    """Give the values of these options as a mission takes them: angles in radians."""
    return {
        "current_m_s": current,
        "current_rad": math.nan if direction is None else math.radians(direction),
        "compass_bias_rad": math.radians(compass_bias),
        "usbl_outliers": outliers,
        "usbl_latency_s": latency,
        "usbl_dropout": dropout,
    }
