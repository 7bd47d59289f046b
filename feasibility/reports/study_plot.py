"""Charts of a study: the covered share over what varies, as SVG for a page."""

from __future__ import annotations

import io
import itertools
import json
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.reports.pages import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from feasibility.studies.store import Row

MAPS = 6  # at most
PANELS = 4  # values of a key that is no number, each with a map of its own
RASTER = 40  # values of a number up to which a map has one field for each pair of values
WRITTEN = 80  # fields of a map up to which their shares are written into them
MOST_TICKS = 8
CRISP = 2_000  # dots that are drawn as vectors; more are rasterized
WIDTH, HEIGHT = 4.6, 3.3  # inches
UNKNOWN = "0.85"
ROUNDING = 1e-6  # [%]: shares are written rounded down, so that 100 means all


class Chart(NamedTuple):
    """One picture: plain text, and an SVG element for a page."""

    caption: str
    svg: str


class Charts(NamedTuple):
    """The pictures of a study."""

    drawn: list[Chart]
    left_out: int
    """Pairs of numbers over which no map is drawn."""


def charts(labels: Sequence[str], rows: Sequence[Row]) -> Charts:
    """The covered share over each number that varies, and maps of it over two of them.

    Args:
        labels: what varies.
        rows: of the study; those without a share, which failed, are left out.
    """
    known = [row for row in rows if "share" in row.result]
    axes = _numbers(labels, known)
    made = [_share_chart(label, axes[label], known) for label in axes]
    pairs = list(itertools.combinations(axes, 2))
    groups = _panels(labels, axes, known)
    chosen = pairs[: max(1, MAPS // len(groups))]
    for across, up in chosen:
        made += [
            _map_chart((across, up), (axes[across][which], axes[up][which]), share, words)
            for words, which, share in groups
        ]
    return Charts(made, len(pairs) - len(chosen))


def _numbers(labels: Sequence[str], rows: Sequence[Row]) -> dict[str, Array]:
    """The values (R,) of what varies and is a number, of those that take two values or more."""
    found = {}
    for label in labels:
        values = [row.parameters[label] for row in rows]
        if are_numbers(values):
            array = np.array(values, dtype=float)
            if len(np.unique(array)) > 1:
                found[label] = array
    return found


def are_numbers(values: Sequence[Any]) -> bool:
    """Are all values numbers?"""
    return all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)


def short(value: Any) -> str:
    """A value in few characters."""
    if isinstance(value, float):
        return f"{value:.4g}"
    return value if isinstance(value, str) else json.dumps(value)


def worded(label: str) -> str:
    """What varies, with its unit.

    Example:
        >>> worded("surface.position.x"), worded("surface.rpy_deg.yaw"), worded("task.cone_deg")
        ('surface x (m)', 'surface yaw (deg)', 'task.cone_deg')
    """
    for table, unit in (("surface.position.", "m"), ("surface.rpy_deg.", "deg")):
        if label.startswith(table):
            return f"surface {label.removeprefix(table)} ({unit})"
    return label


def _shares(rows: Sequence[Row]) -> Array:
    """(R,) covered shares of the area in percent."""
    return np.array([100.0 * float(row.result["share"]) for row in rows])


def _panels(
    labels: Sequence[str], axes: Mapping[str, Any], rows: Sequence[Row]
) -> list[tuple[str, Mask, Array]]:
    """Rows that share a map: by the first key that is no number, if it has few values."""
    share = _shares(rows)
    for label in labels:
        words = np.array([short(row.parameters[label]) for row in rows], dtype=object)
        values = list(dict.fromkeys(words.tolist()))
        if label not in axes and 2 <= len(values) <= PANELS:
            return [
                (f"{label} = {value}", words == value, share[words == value]) for value in values
            ]
    return [("", np.ones(len(rows), dtype=bool), share)]


def _share_chart(label: str, values: Array, rows: Sequence[Row]) -> Chart:
    """The share of every row over one number, and the best and the mean share at each value."""
    share = _shares(rows)
    verdicts = np.array([str(row.result["verdict"]) for row in rows])
    ends = np.unique(values)
    figure, axes = _axes(worded(label), "covered in one motion (%)")
    axes.set_ylim(-4.0, 104.0)
    axes.grid(color="0.92")
    for verdict, colour in COLOURS.items():
        which = verdicts == verdict
        if which.any():
            axes.plot(
                values[which], share[which], "o", color=colour, alpha=0.55, markersize=4,
                markeredgewidth=0, label=verdict, rasterized=len(rows) > CRISP,
            )  # fmt: skip
    if len(ends) <= RASTER:
        for words, style, reduced in (("best", "-", np.max), ("mean", "--", np.mean)):
            line = [float(reduced(share[values == end])) for end in ends]
            axes.plot(ends, line, style, color="0.25", linewidth=1, label=words, zorder=0)
    figure.legend(fontsize=8, loc="outside upper center", ncols=5, frameon=False)
    return Chart(f"Covered share over {worded(label)}", _svg(figure, label))


def _map_chart(
    labels: tuple[str, str],
    values: tuple[Array, Array],
    share: Array,
    words: str,
) -> Chart:
    """The share over two numbers: fields with the best of each pair of values, or dots."""
    across, up = (np.unique(part) for part in values)
    figure, axes = _axes(worded(labels[0]), worded(labels[1]))
    scale: dict[str, Any] = {"vmin": 0.0, "vmax": 100.0, "cmap": "viridis"}
    caption = f"over {worded(labels[0])} and {worded(labels[1])}"
    caption += f", {words}" if words else ""
    if len(across) <= RASTER and len(up) <= RASTER and len(across) * len(up) <= 4 * len(share):
        fields = np.full((len(up), len(across)), np.nan)
        np.fmax.at(
            fields, (np.searchsorted(up, values[1]), np.searchsorted(across, values[0])), share
        )
        axes.set_facecolor(UNKNOWN)
        drawn: Any = axes.imshow(fields, origin="lower", aspect="auto", **scale)
        _ticks(axes.set_xticks, across)
        _ticks(axes.set_yticks, up)
        for (j, i), value in np.ndenumerate(fields if fields.size <= WRITTEN else np.empty((0, 0))):
            if np.isfinite(value):
                style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8}
                style["color"] = "black" if value > 60 else "white"
                axes.text(i, j, f"{int(value + ROUNDING)}", **style)
        caption = f"Best covered share {caption}"
    else:
        order = np.argsort(share, kind="stable")  # the best on top
        drawn = axes.scatter(
            values[0][order], values[1][order], c=share[order], s=16, linewidths=0,
            rasterized=len(share) > CRISP, **scale,
        )  # fmt: skip
        caption = f"Covered share of each case {caption}"
    figure.colorbar(drawn, ax=axes, label="covered in one motion (%)")
    return Chart(caption, _svg(figure, caption))


def _ticks(put: Any, values: Array) -> None:
    """Name at most `MOST_TICKS` of the places 0, 1, 2, ... by their values."""
    step = -(-len(values) // MOST_TICKS)
    places = np.arange(0, len(values), step)
    put(places, [f"{value:.4g}" for value in values[places]])


def _axes(xlabel: str, ylabel: str) -> tuple[Figure, Axes]:
    """An empty figure with named axes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
    return figure, figure.add_subplot(xlabel=xlabel, ylabel=ylabel)


def _svg(figure: Figure, salt: str) -> str:
    """A figure as an SVG element that can stand in a page beside others."""
    import matplotlib as mpl

    stream = io.StringIO()
    nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    # Names inside the drawing are made from the salt: no two drawings of a page share one.
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": salt}):
        figure.savefig(stream, format="svg", metadata=nothing)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r' xmlns(:\w+)?="[^"]*"', "", text)
    return re.sub(r'<g id="[^"]*"', "<g", text).strip()
