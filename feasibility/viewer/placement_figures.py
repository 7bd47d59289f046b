"""Flat pictures of placements: the map of a region, with the feasible placements marked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from feasibility.placement import AXES, Array, PlacementMap, Placements
from feasibility.viewer.paper_figures import Plot

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEST, OTHERS = "#d62728", "white"
UNKNOWN = "0.85"


def plot_map(
    charted: PlacementMap,
    placements: Placements | None = None,
    value: Literal["share", "margin"] = "share",
    title: str | None = None,
) -> Plot:
    """Covered share, or margin, over two axes; one panel for each value along a third.

    Args:
        charted: the map.
        placements: its feasible placements are marked, each in the panel nearest to it.
        value: what the colours show.
        title: above the figure.
    """
    values = getattr(charted, value).reshape(*charted.share.shape[:2], -1)
    panels = charted.ticks[2] if len(charted.ticks) > 2 else np.zeros(1)
    figure = Plot(figsize=(1.2 + 3.4 * len(panels), 3.6), layout="constrained")
    grid = figure.subplots(1, len(panels), squeeze=False, sharex=True, sharey=True)[0]
    most = 1.0 if value == "share" else max(float(np.nanmax(values, initial=0.0)), 1e-9)
    fields = []
    for k, axes in enumerate(grid):
        axes.set_facecolor(UNKNOWN)
        drawn = axes.pcolormesh(
            _edges(charted.ticks[0]), _edges(charted.ticks[1]), values[:, :, k].T,
            vmin=0.0, vmax=most, cmap="viridis", rasterized=True,
        )  # fmt: skip
        fields.append(drawn)
        axes.set_xlabel(_label(charted.axes[0]))
        if len(charted.ticks) > 2:
            name, unit = _name_and_unit(charted.axes[2])
            axes.set_title(f"{name} {panels[k]:.3g} {unit}")
    grid[0].set_ylabel(_label(charted.axes[1]))
    if placements is not None:
        _mark(grid, charted, placements)
    what = "share of the area in one motion" if value == "share" else "margin"
    figure.colorbar(fields[0], ax=list(grid), label=what)
    if title:
        figure.suptitle(title)
    return figure


def _mark(grid: Array, charted: PlacementMap, placements: Placements) -> None:
    """The best as a star, other feasible placements as dots."""
    where = [AXES.index(name) for name in charted.axes]
    for rank, trial in enumerate(placements.found):
        place = trial.pose.values[where]
        panel = int(np.abs(charted.ticks[2] - place[2]).argmin()) if len(place) > 2 else 0
        axes: Axes = grid[panel]
        if rank == 0:
            axes.plot(*place[:2], "*", color=BEST, markersize=15, markeredgecolor="white", zorder=3)
        else:
            axes.plot(*place[:2], "o", color=OTHERS, markersize=5, markeredgecolor="black")


def _edges(ticks: Array) -> Array:
    """Borders of the fields around some places."""
    if len(ticks) == 1:
        return ticks[0] + np.array([-0.5, 0.5])
    middles = 0.5 * (ticks[:-1] + ticks[1:])
    return np.concatenate([[ticks[0]], middles, [ticks[-1]]])


def _label(axis: str) -> str:
    """An axis with its unit."""
    return "{} ({})".format(*_name_and_unit(axis))


def _name_and_unit(axis: str) -> tuple[str, str]:
    """An axis of a region, and 'm' or 'deg'."""
    return axis.removesuffix("_deg"), "deg" if axis.endswith("_deg") else "m"
