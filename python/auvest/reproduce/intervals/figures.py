"""The picture of ``auvest reproduce intervals``."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from matplotlib.figure import Figure

from auvest import plots
from auvest.reproduce.intervals.measure import (
    BUDGET_SIGMAS,
    NAMES,
    NOISES,
    POLICIES,
    TRACKS,
    Reproduction,
)

_LOOKS = {
    "budget": (plots.BLUE, "o-"),
    "fixed": (plots.BLACK, "s--"),
    "law": (plots.VERMILION, "^-"),
    "law_truth": (plots.ORANGE, "v:"),
}
_RATES = (0.5, 1.0, 2.0, 4.0, 8.0)  # Hz


def plane(result: Reproduction) -> Figure:
    """Draw RMSE and time above the budget over samples per second, a column per track.

    The rows are pairs of both for each noise.
    """
    figure = plots.new_figure((12.0, 13.0), "Interval policies: error over samples per second")
    axes = figure.subplots(2 * len(NOISES), len(TRACKS), squeeze=False)
    for column, track in enumerate(TRACKS):
        for row, noise in enumerate(NOISES):
            points = [case for case in result.cases if (case.track, case.noise) == (track, noise)]
            error, above = axes[2 * row, column], axes[2 * row + 1, column]
            for name in POLICIES:
                rate = [1 / case.policies[name].interval_s for case in points]
                colour, mark = _LOOKS[name]
                style = {"color": colour, "label": NAMES[name], "markersize": 4.5}
                error.plot(rate, [c.policies[name].rmse_m for c in points], mark, **style)
                above.plot(rate, [100 * c.policies[name].above for c in points], mark, **style)
            for panel, title in ((error, f"{track}; {noise}"), (above, "")):
                panel.set_xscale("log")
                panel.set_xticks(_RATES, [f"{rate:g}" for rate in _RATES])
                panel.minorticks_off()
                plots.style(panel, title=title, xlim=(0.45, 9.0))
            above.set_ylim(bottom=0)
            if column == 0:
                error.set_ylabel("RMSE / m")
                above.set_ylabel(f"above {BUDGET_SIGMAS:g} sigma / %")
            if row == len(NOISES) - 1:
                above.set_xlabel("samples per second / Hz")
    plots.legend_below(figure, axes[0, 0], columns=len(POLICIES))
    return figure


#: How the picture is drawn, by file stem.
FIGURES: Mapping[str, Callable[[Reproduction], Figure]] = {"intervals": plane}
