"""Flat pictures of placements: the map of a region, with the feasible placements marked."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Literal

import numpy as np

from feasibility.placement import AXES, Array, PlacementMap, Placements

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BEST, OTHERS = "#d62728", "white"
UNKNOWN = "0.85"
DOTS_PER_INCH = 110


def plot_map(
    charted: PlacementMap,
    placements: Placements | None = None,
    value: Literal["share", "margin"] = "share",
    title: str | None = None,
) -> Figure:
    """Covered share, or margin, over two axes; one panel for each place along a third.

    Args:
        charted: the map.
        placements: its feasible placements are marked, each in the panel nearest to it.
        value: what the colours tell.
        title: above the figure.
    """
    values = getattr(charted, value).reshape(*charted.share.shape[:2], -1)
    panels = charted.ticks[2] if len(charted.ticks) > 2 else np.zeros(1)
    figure = _figure(1.2 + 3.4 * len(panels), 3.6)
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
        axes.set_xlabel(label(charted.axes[0]))
        if len(charted.ticks) > 2:
            axes.set_title(f"{name_of(charted.axes[2])} {panels[k]:.3g}{_unit(charted.axes[2])}")
    grid[0].set_ylabel(label(charted.axes[1]))
    if placements is not None:
        _mark(grid, charted, placements)
    what = "share of the area in one motion" if value == "share" else "margin"
    figure.colorbar(fields[0], ax=list(grid), label=what)
    if title:
        figure.suptitle(title)
    return figure


def _figure(width: float, height: float) -> Figure:
    """A figure (inches) that notebooks show without being told how."""
    from matplotlib.figure import Figure

    class Plot(Figure):
        def _repr_png_(self) -> bytes:
            stream = io.BytesIO()
            self.savefig(stream, format="png", dpi=DOTS_PER_INCH)
            return stream.getvalue()

    return Plot(figsize=(width, height), layout="constrained")


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


def label(axis: str) -> str:
    """An axis with its unit."""
    return f"{name_of(axis)} ({'deg' if axis.endswith('_deg') else 'm'})"


def name_of(axis: str) -> str:
    """An axis without its unit."""
    return axis.removesuffix("_deg")


def _unit(axis: str) -> str:
    """What stands behind a number."""
    return "\N{DEGREE SIGN}" if axis.endswith("_deg") else " m"
