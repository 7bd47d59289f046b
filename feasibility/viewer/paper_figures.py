"""Flat pictures of a verdict, for notebooks and papers: Figures 2 and 3 of the paper, and causes.

Every function returns a figure of its own and leaves matplotlib's global state alone, so it works
without a display and beside whatever else a notebook draws. `figure.savefig("g.pdf")` writes it.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from coverable_errors import ArgumentError
from feasibility.verdict import Verdict
from feasibility.viewer.scene import CAUSES, CENTRES, EDGES, MISSED, START, missed_by_cause
from robots import Kinematics
from surfaces import Cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DOTS_PER_INCH = 110
BORDERS = (0.72, 0.75, 0.78)


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
        title: above the figure; default says what is covered.
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
    axes.scatter(
        centres[covered, 0], centres[covered, 1], s=14, color=[CENTRES], zorder=3, label="covered"
    )
    if not covered.all():
        axes.scatter(
            centres[~covered, 0],
            centres[~covered, 1],
            s=30,
            color=[MISSED],
            zorder=3,
            label="not covered",
        )
    _mark_start(axes, verdict)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def plot_causes(verdict: Verdict, title: str | None = None) -> Plot:
    """Which cells are not covered, and why: one colour for each cause.

    Args:
        verdict: of either method.
        title: above the figure; default says what is covered.
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    figure, axes = _over_parameters(verdict, title)
    outlines = verdict.cells.unrolled().outlines
    handles = [Patch(color=(0.86, 0.91, 0.96), label=f"covered ({verdict.n_covered})")]
    axes.add_collection(
        PolyCollection(
            [outlines[k] for k in np.flatnonzero(verdict.covered)],
            facecolors=[(0.86, 0.91, 0.96)],
            edgecolors="w",
        )
    )
    for kind, cells in missed_by_cause(verdict).items():
        colour = MISSED if kind is None else CAUSES[kind]
        words = "cause not known" if kind is None else kind.replace("_", " ")
        missed = [outlines[k] for k in cells]
        axes.add_collection(PolyCollection(missed, facecolors=[colour], edgecolors="w"))
        handles.append(Patch(color=colour, label=f"{words} ({len(cells)})"))
    _mark_start(axes, verdict)
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
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
    axes.set_xlabel(_joint_label(verdict, first))
    axes.set_ylabel(_joint_label(verdict, second))
    axes.set_title(
        f"From E-cell {_name(verdict.cells, a)} to {_name(verdict.cells, b)}: "
        f"{len(motion)} configurations"
    )
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    return figure


def cells_below(verdict: Verdict, walk: NDArray[np.float64]) -> NDArray[np.int64]:
    """The cell (k,) below the tool point at each row of a walk (k, n); -1 off the patch."""
    points, _ = Kinematics(verdict.robot).tools(walk)
    return verdict.cells.locate(points)


def unrolled_edges(verdict: Verdict) -> list[NDArray[np.float64]]:
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
    surface = verdict.cells.surface
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
    axes.set_xlabel(flat.labels[0])
    axes.set_ylabel(flat.labels[1])
    edges = verdict.n_edges
    axes.set_title(
        title
        or f"{verdict.robot.name} on a {surface.kind}: {verdict.n_covered} of "
        f"{len(verdict.cells)} cells, {edges} edges"
    )
    return figure, axes


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
    if edge is None:
        if not edges:
            raise ArgumentError("the verdict's graph has no edge with a motion to draw")
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


def _joint_label(verdict: Verdict, joint: int) -> str:
    """A joint's name with its unit; a dollar sign in it is no mathematics."""
    name = verdict.robot.joint_names[joint].replace("$", r"\$")
    return f"{name} ({'mm' if verdict.robot.prismatic[joint] else 'degrees'})"
