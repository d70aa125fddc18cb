"""The picture of ``auvest reproduce mrclam6``."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from matplotlib.figure import Figure

from auvest import plots
from auvest.reproduce.mrclam6.measure import NAMES, Reproduction, Track

_COLOURS = {
    "dead_reckoning": plots.GREY,
    **{name: plots.SLAT_COLOURS[name] for name in ("ekf_slat", "slatf2")},
}
_PANELS = 6


def longest(tracks: list[Track]) -> list[int]:
    """Give the numbers of the tracks that the picture shows: the longest, longest first."""
    order = sorted(range(len(tracks)), key=lambda k: tracks[k].time_s[0] - tracks[k].time_s[-1])
    return order[:_PANELS]


def some_tracks(result: Reproduction) -> Figure:
    """Draw slave (thin) and master (thick) of the longest tracks: truth and estimates."""
    figure = plots.new_figure((8.4, 6.4), "Slave (thin) and master (thick): truth and estimates")
    panels = figure.subplots(2, _PANELS // 2, squeeze=False).ravel()
    for panel, k in zip(panels, longest(result.tracks), strict=False):
        track = result.tracks[k]
        panel.plot(*track.slave_truth[:, :2].T, color=plots.BLACK, linewidth=1, label="truth")
        panel.plot(*track.master_truth.T, color=plots.BLACK, linewidth=2.5, alpha=0.7)
        panel.plot(*track.slave_truth[0, :2], "o", color=plots.BLACK, markersize=4)
        for name, colour in _COLOURS.items():
            path = result.paths[name][k]
            panel.plot(*path.slave.T, color=colour, linewidth=1, label=NAMES[name])
            panel.plot(*path.master.T, color=colour, linewidth=2.5, alpha=0.7)
        seconds = track.time_s[-1] - track.time_s[0]
        panel.set_aspect("equal", adjustable="datalim")
        title = f"robot {track.slave} sees {track.master}, {seconds:.0f} s"
        plots.style(panel, title=title, xlabel="x / m", ylabel="y / m")
    plots.legend_below(figure, panels[0], columns=1 + len(_COLOURS))
    return figure


#: How the picture is drawn, by file stem.
FIGURES: Mapping[str, Callable[[Reproduction], Figure]] = {"tracks": some_tracks}
