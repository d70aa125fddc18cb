"""Figs 1 to 10 of the AUKF paper, drawn from our measurements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from matplotlib.figure import Figure

from auvest import plots
from auvest.plots import FILTER_COLOURS, Line
from auvest.reproduce.aukf.measure import Reproduction, paper_station, tables
from auvest.simulation.paper_aukf import NOISE_KINDS, TAU0_STUDIED, NoiseKind

_NAMES: Mapping[NoiseKind, str] = {
    "uniform": "uniform noise",
    "normal": "Gaussian noise",
    "lognormal": "logarithmic noise",
}


def _track(result: Reproduction, *, stem: str, name: str, title: str) -> Figure:
    columns = tables(result)[stem]
    return plots.track_figure(
        *(plots.pair(columns[f"{kind}_x_m"], columns[f"{kind}_y_m"])
          for kind in ("true", "estimated", "observed")),
        station=paper_station(),
        title=title,
        label=f"{name.upper()} estimate",
        colour=FILTER_COLOURS[name],
    )  # fmt: skip


def _interval(result: Reproduction) -> Figure:
    columns = tables(result)["fig03"]
    mean = columns["aukf_interval_s"]
    return plots.step_figure(
        [
            Line("UKF", columns["ukf_interval_s"], colour=FILTER_COLOURS["ukf"]),
            Line(
                f"AUKF, preset figure3: mean and 5 to 95 % of {result.runs} runs",
                mean,
                low=columns["aukf_interval_p05_s"],
                high=columns["aukf_interval_p95_s"],
                colour=FILTER_COLOURS["aukf"],
            ),
            Line("AUKF, one run", columns["aukf_interval_one_run_s"], colour=plots.SKY, style=":"),
            Line("AUKF, Table 1 to the letter", columns["table1_interval_s"], colour=plots.BLACK),
        ],
        title="Fig. 3: sampling interval",
        ylabel="T / s",
    )


def _error(result: Reproduction, *, stem: str, title: str) -> Figure:
    columns = tables(result)[stem]
    steps = columns["step"]

    def line(label: str, column: str, name: str, style: str = "-") -> Line:
        return Line(label, columns[column], x=steps, colour=FILTER_COLOURS[name], style=style)

    return plots.error_figure(
        [
            line("UKF", "ukf_error_x_m", "ukf"),
            line("AUKF", "aukf_error_x_m", "aukf", "--"),
        ],
        [
            line("UKF, T = 0.5 s", "ukf_rms_error_x_m", "ukf"),
            line("AUKF", "aukf_rms_error_x_m", "aukf", "--"),
            Line(
                "UKF at the AUKF's mean interval",
                columns["equal_rate_ukf_rms_error_x_m"],
                x=steps,
                colour=plots.ORANGE,
                style=":",
            ),
        ],
        title=title,
    )


#: How each figure is drawn, by file stem.
FIGURES: dict[str, Callable[[Reproduction], Figure]] = {
    "fig01": partial(_track, stem="fig01", name="ukf", title="Fig. 1: UKF, uniform noise"),
    "fig02": partial(_track, stem="fig02", name="aukf", title="Fig. 2: AUKF, uniform noise"),
    "fig03": _interval,
}
for _number, _tau0 in enumerate(TAU0_STUDIED, start=4):
    _stem = f"fig{_number:02d}"
    FIGURES[_stem] = partial(
        _track, stem=_stem, name="aukf", title=f"Fig. {_number}: AUKF, tau(0) = {_tau0:g}"
    )
for _number, _kind in enumerate(NOISE_KINDS, start=8):
    _stem = f"fig{_number:02d}"
    FIGURES[_stem] = partial(_error, stem=_stem, title=f"Fig. {_number}: x error, {_NAMES[_kind]}")
