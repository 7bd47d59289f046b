"""Flat pictures for notebooks and papers: Figures 2 and 3 of the paper, causes, placement maps.

Every function returns a figure of its own and leaves matplotlib's global state alone, so it works
without a display and beside whatever else a notebook draws. `figure.savefig("g.pdf")` writes it.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.figure import Figure

from coverable.arrays import Array, Ints
from coverable.errors import ArgumentError
from feasibility.placement.map import PlacementMap
from feasibility.placement.placements import Placements
from feasibility.placement.region import AXES
from feasibility.verdict import Verdict
from feasibility.viewer.cell_meshes import COLOURS, LOST, sides_of
from feasibility.viewer.threejs import Colour
from feasibility.viewer.verdict_scene import CENTRES, EDGES, MISSED, START, missed_groups
from robots.kinematics import Kinematics
from surfaces.cells import Cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch


DOTS_PER_INCH = 110
BORDERS = (0.72, 0.75, 0.78)
COVERED = (0.86, 0.91, 0.96)
BEST, OTHERS = "#d62728", "white"
UNKNOWN = "0.85"
NOT_REACHED = (0.95, 0.95, 0.95)


class Plot(Figure):
    """A figure that notebooks display."""

    def _repr_png_(self) -> bytes:
        """The figure as PNG."""
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=DOTS_PER_INCH)
        return stream.getvalue()


def plot_graph(verdict: Verdict, title: str | None = None) -> Plot:
    """Graph G laid flat, cells that are not covered in red (Fig. 3).

    Args:
        verdict: of either method.
        title: above the figure, before the verdict; default names the arm and the surface.
    """
    from matplotlib.collections import LineCollection

    figure, axes = _over_parameters(verdict, title)
    if len(verdict.cells.shape) == 1:  # not a grid, whose borders one can guess
        outlines = verdict.cells.unrolled().outlines
        borders = LineCollection(outlines, colors=[BORDERS], linewidths=0.6, zorder=1)
        axes.add_collection(borders)
    lines = unrolled_edges(verdict)
    axes.add_collection(LineCollection(lines, colors=[EDGES], linewidths=1.0, zorder=2))
    centres, covered = verdict.cells.unrolled().centres, verdict.covered
    x, y = centres.T
    axes.scatter(x[covered], y[covered], s=14, color=[CENTRES], zorder=3, label="covered")
    if not covered.all():
        axes.scatter(x[~covered], y[~covered], s=30, color=[MISSED], zorder=3, label="not covered")
    _mark_start(axes, verdict)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def plot_causes(verdict: Verdict, title: str | None = None) -> Plot:
    """Which cells are not covered, and why: one colour for each cause.

    Args:
        verdict: of either method.
        title: above the figure, before the verdict; default names the arm and the surface.
    """
    figure, axes = _over_parameters(verdict, title)
    outlines = verdict.cells.unrolled().outlines
    groups = [("covered", COVERED, np.flatnonzero(verdict.covered))]
    for missed in missed_groups(verdict.causes, np.flatnonzero(~verdict.covered)):
        groups.append((missed.words, missed.colour, missed.which))
    handles = []
    for words, colour, cells in groups:
        handles.append(_fill(axes, outlines, cells, colour, f"{words} ({len(cells)})"))
    _mark_start(axes, verdict)
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
    return figure


def plot_sides(verdict: Verdict, title: str | None = None) -> Plot:
    """Which cells are reached below the first cut of a proof, which above, and which on both sides.

    Args:
        verdict: infeasible by a cut tree.
        title: above the figure, before the verdict; default names the arm and the surface.

    Raises:
        ArgumentError: its proof is no cut.
    """
    sides = sides_of(verdict)
    if sides is None:
        raise ArgumentError("sides are drawn of a verdict whose proof is a cut")
    figure, axes = _over_parameters(verdict, title)
    outlines, centres = verdict.cells.unrolled().outlines, verdict.cells.unrolled().centres
    handles: list[Any] = []
    names = (*sides.names, "not reached")
    colours = (*COLOURS, NOT_REACHED)
    for k, words in enumerate(names):
        label, colour = k if k < len(COLOURS) else -1, colours[k]
        which = np.flatnonzero(sides.labels == label)
        if len(which):
            handles.append(_fill(axes, outlines, which, colour, words))
    x, y = centres[list(sides.lost)].T
    handles.append(axes.scatter(x, y, s=40, marker="D", color=[LOST], label=sides.lost_name))
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    return figure


def plot_transition(verdict: Verdict, edge: tuple[int, int] | None = None) -> Plot:
    """The motion of one edge of G, in the two joints that move most (Fig. 2).

    Every waypoint (a J-cell of the greedy search) is a dot in the colour of the E-cell that its
    tool point lies over.

    Args:
        verdict: with at least one edge.
        edge: two neighbouring cells; default is the edge that moves a second joint most.

    Raises:
        ArgumentError: there is no such edge, or it has no motion.
    """
    a, b = _edge(verdict, edge)
    motion = np.asarray(verdict.graph.edges[a, b]["motion"], dtype=float)
    robot = verdict.robot
    # The two that move most, in the order of the chain; an arm of one joint twice.
    most = np.sort(np.argsort(-np.ptp(motion, axis=0), kind="stable")[:2])
    first, second = int(most[0]), int(most[-1])
    units = np.where(robot.prismatic, 1e3, 180.0 / np.pi)
    over = cells_below(verdict, motion)
    figure = Plot(figsize=(6.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    x, y = motion[:, first] * units[first], motion[:, second] * units[second]
    axes.plot(x, y, color=(0.8, 0.8, 0.8), linewidth=0.8, zorder=1)
    colours = [EDGES, (0.90, 0.60, 0.00), START, (0.80, 0.47, 0.65)]
    for number, cell in enumerate(dict.fromkeys([a, b, *over.tolist()])):
        mask = over == cell
        name = "off the patch" if cell < 0 else f"E-cell {_name(verdict.cells, cell)}"
        colour = colours[number % len(colours)]
        axes.scatter(x[mask], y[mask], s=12, color=[colour], label=name, zorder=2)
        for end in (0, -1):  # a single dot in its cell is easily lost
            if mask[end]:
                axes.plot(x[end], y[end], "s", color=colour, markeredgecolor="k", zorder=3)
    axes.set(xlabel=_joint_label(verdict, first), ylabel=_joint_label(verdict, second))
    ends = f"{_name(verdict.cells, a)} to {_name(verdict.cells, b)}"
    axes.set_title(f"From E-cell {ends}: {len(motion)} configurations")
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    return figure


def cells_below(verdict: Verdict, walk: Array) -> Ints:
    """The cell (k,) below the tool point at each row of a walk (k, n); -1 off the patch."""
    points, _ = Kinematics(verdict.robot).tools(walk)
    return verdict.cells.locate(points)


def unrolled_edges(verdict: Verdict) -> list[Array]:
    """The edges of G over the parameters, as drawn: lines (2, 2) of (v, u) in degrees or metres.

    An edge across the seam of a closed patch becomes two lines, one at either border.
    """
    flat = verdict.cells.unrolled()
    turns = np.array(flat.turns)
    lines = []
    for a, b in verdict.graph.edges:
        ends = flat.centres[[a, b]]
        # Towards the copy of b that is nearest to a, and back from that of a nearest to b.
        shift = np.where(np.isfinite(turns), np.rint((ends[1] - ends[0]) / turns), 0.0)
        jump = np.where(shift != 0.0, shift * np.where(np.isfinite(turns), turns, 0.0), 0.0)
        if jump.any():
            lines.append(np.array([ends[0], (ends[0] + ends[1] - jump) / 2.0]))
            lines.append(np.array([(ends[0] + jump + ends[1]) / 2.0, ends[1]]))
        else:
            lines.append(ends)
    return lines


def _over_parameters(verdict: Verdict, title: str | None) -> tuple[Plot, Axes]:
    """A figure over the parameters: v to the right, u down, as cells are numbered.

    A mesh has none; it is drawn flat, with equal scales.
    """
    figure = Plot(figsize=(6.4, 5.2), layout="constrained")
    axes = figure.add_subplot()
    flat = verdict.cells.unrolled()
    if flat.outlines:
        corners = np.concatenate(flat.outlines)
        if len(verdict.cells.shape) == 1 and all("(m)" in label for label in flat.labels):
            axes.set_aspect("equal")
            width, height = np.ptp(corners, axis=0)
            figure.set_figheight(float(np.clip(5.6 * height / width + 1.3, 2.8, 7.0)))
        axes.set_xlim(corners[:, 0].min(), corners[:, 0].max())
        axes.set_ylim(corners[:, 1].max(), corners[:, 1].min())
    what = f"{verdict.robot.name} on a {verdict.cells.surface.kind}"
    axes.set(xlabel=flat.labels[0], ylabel=flat.labels[1])
    axes.set_title(f"{title or what}: {in_short(verdict)}")
    return figure, axes


def in_short(verdict: Verdict) -> str:
    """The verdict in a few words: 'infeasible, 60 of 90 cells, 194 edges'."""
    covered = f"{verdict.n_covered} of {len(verdict.cells)} cells"
    return f"{verdict.answer}, {covered}, {verdict.n_edges} edges"


def _fill(axes: Axes, outlines: Sequence[Array], cells: Ints, colour: Colour, label: str) -> Patch:
    """Fill some cells (k,); returns their line of the legend."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    shapes = [outlines[k] for k in cells]
    axes.add_collection(PolyCollection(shapes, facecolors=[colour], edgecolors="w"))
    return Patch(color=colour, label=label)


def _mark_start(axes: Axes, verdict: Verdict) -> None:
    """A ring around the cell where the search starts."""
    if verdict.start is None:
        return
    x, y = verdict.cells.unrolled().centres[verdict.start]
    axes.scatter(
        [x], [y], s=110, facecolors="none", edgecolors=[START],
        linewidths=2.0, zorder=4, label="start",
    )  # fmt: skip


def _edge(verdict: Verdict, edge: tuple[int, int] | None) -> tuple[int, int]:
    """The edge to draw, smaller index first."""
    edges: dict[tuple[int, int], Any] = {
        (min(a, b), max(a, b)): motion
        for a, b, motion in verdict.graph.edges(data="motion")
        if motion is not None and len(motion)
    }
    if edge is None and not edges:
        raise ArgumentError("the verdict's graph has no edge with a motion to draw")
    if edge is None:
        return max(edges, key=lambda key: float(np.sort(np.ptp(edges[key], axis=0))[-2:].min()))
    key = (min(edge), max(edge))
    if key not in edges:
        raise ArgumentError(
            f"G has no edge between the cells {edge[0]} and {edge[1]} with a motion"
        )
    return key


def _name(cells: Cells, cell: int) -> str:
    """A cell as (row, column), or by its number on a mesh."""
    index = cells.unravel(cell)
    return str(index) if len(index) > 1 else str(index[0])


def plain(text: str) -> str:
    """A text for a figure: a dollar sign in it is no mathematics."""
    return text.replace("$", r"\$")


def _joint_label(verdict: Verdict, joint: int) -> str:
    """A joint's name with its unit."""
    name = plain(verdict.robot.joint_names[joint])
    return f"{name} ({'mm' if verdict.robot.prismatic[joint] else 'degrees'})"


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
    for k, axes in enumerate(grid):
        axes.set_facecolor(UNKNOWN)
        drawn = axes.pcolormesh(
            _edges(charted.ticks[0]), _edges(charted.ticks[1]), values[:, :, k].T,
            vmin=0.0, vmax=most, cmap="viridis", rasterized=True,
        )  # fmt: skip
        axes.set_xlabel(_label(charted.axes[0]))
        if len(charted.ticks) > 2:
            name, unit = _name_and_unit(charted.axes[2])
            axes.set_title(f"{name} {panels[k]:.3g} {unit}")
    grid[0].set_ylabel(_label(charted.axes[1]))
    if placements is not None:
        _mark(grid, charted, placements)
    what = "share of the area in one motion" if value == "share" else "margin (m)"
    figure.colorbar(drawn, ax=list(grid), label=what)
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
