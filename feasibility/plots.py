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

from feasibility.scene import CAUSES, CENTRES, EDGES, MISSED, START, missed_by_cause
from feasibility.verdict import Verdict
from robots.kinematics import Kinematics
from surfaces import Cells, Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DOTS_PER_INCH = 110


class Plot(Figure):
    """A figure that notebooks show without being told how."""

    def _repr_png_(self) -> bytes:
        """The figure as PNG."""
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=DOTS_PER_INCH)
        return stream.getvalue()


def plot_graph(verdict: Verdict, title: str | None = None) -> Plot:
    """Graph G unrolled over the parameters, cells that are not covered in red (Fig. 3).

    Args:
        verdict: of either method, on a parametric surface.
        title: above the figure; default says what is covered.
    """
    from matplotlib.collections import LineCollection

    figure, axes = _over_parameters(verdict, title)
    lines = unrolled_edges(verdict)
    axes.add_collection(LineCollection(lines, colors=[EDGES], linewidths=1.0, zorder=2))
    u, v = _scaled(verdict.cells)
    covered = verdict.covered
    axes.scatter(v[covered], u[covered], s=14, color=[CENTRES], zorder=3, label="covered")
    if not covered.all():
        axes.scatter(v[~covered], u[~covered], s=30, color=[MISSED], zorder=3, label="not covered")
    _mark_start(axes, verdict)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def plot_causes(verdict: Verdict, title: str | None = None) -> Plot:
    """Which cells are not covered, and why: one colour for each cause.

    Args:
        verdict: of either method, on a parametric surface.
        title: above the figure; default says what is covered.
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    figure, axes = _over_parameters(verdict, title)
    boxes = _boxes(verdict.cells)
    handles = [Patch(color=(0.86, 0.91, 0.96), label=f"covered ({verdict.n_covered})")]
    axes.add_collection(
        PolyCollection(
            list(boxes[verdict.covered]), facecolors=[(0.86, 0.91, 0.96)], edgecolors="w"
        )
    )
    for kind, cells in missed_by_cause(verdict).items():
        colour = MISSED if kind is None else CAUSES[kind]
        words = "cause not known" if kind is None else kind.replace("_", " ")
        axes.add_collection(PolyCollection(list(boxes[cells]), facecolors=[colour], edgecolors="w"))
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
        ValueError: there is no such edge, or it has no motion.
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
    kinematics = Kinematics(verdict.robot)
    foot = verdict.cells.surface.closest(np.array([kinematics.tool(q)[0] for q in walk]))
    surface, (nu, nv) = verdict.cells.surface, verdict.cells.shape
    rows = _bin(foot.u, surface.u_range, nu)
    columns = _bin(foot.v, surface.v_range, nv)
    return np.where(foot.inside, rows * nv + columns, -1)


def unrolled_edges(verdict: Verdict) -> list[NDArray[np.float64]]:
    """The edges of G over the parameters, as drawn: lines (2, 2) of (v, u) in degrees or metres.

    An edge across the seam of a closed patch becomes two lines, one at either border.
    """
    cells = verdict.cells
    u, v = _scaled(cells)
    turns = np.array([_turn(cells, "v"), _turn(cells, "u")])
    lines = []
    for a, b in verdict.graph.edges:
        ends = np.array([[v[a], u[a]], [v[b], u[b]]])
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
    """A figure over the parameters: v to the right, u down, as cells are numbered."""
    surface = verdict.cells.surface
    figure = Plot(figsize=(6.4, 5.2), layout="constrained")
    axes = figure.add_subplot()
    axes.set_xlim(*_scale(surface, "v", np.array(surface.v_range)))
    axes.set_ylim(*_scale(surface, "u", np.array(surface.u_range))[::-1])
    axes.set_xlabel(f"v ({_unit(surface, 'v')})")
    axes.set_ylabel(f"u ({_unit(surface, 'u')})")
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
    u, v = _scaled(verdict.cells)
    axes.scatter(
        [v[verdict.start]], [u[verdict.start]], s=110, facecolors="none", edgecolors=[START],
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
            raise ValueError("the verdict's graph has no edge with a motion to draw")
        return max(edges, key=lambda key: float(np.sort(np.ptp(edges[key], axis=0))[-2:].min()))
    key = (min(edge), max(edge))
    if key not in edges:
        raise ValueError(f"G has no edge between the cells {edge[0]} and {edge[1]} with a motion")
    return key


def _boxes(cells: Cells) -> NDArray[np.float64]:
    """The cells as rectangles (N, 4, 2) over (v, u), degrees or metres."""
    u, v = _scaled(cells)
    surface = cells.surface
    half_u = np.ptp(_scale(surface, "u", np.array(surface.u_range))) / max(2 * cells.shape[0], 1)
    half_v = np.ptp(_scale(surface, "v", np.array(surface.v_range))) / max(2 * cells.shape[1], 1)
    corners = np.array([[-half_v, -half_u], [half_v, -half_u], [half_v, half_u], [-half_v, half_u]])
    return np.column_stack([v, u])[:, None] + corners


def _scaled(cells: Cells) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Parameters u and v of the centres, (N,) each, in degrees or metres."""
    return _scale(cells.surface, "u", cells.u), _scale(cells.surface, "v", cells.v)


def _scale(surface: Surface, name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values of parameter 'u' or 'v', angles in degrees."""
    return np.degrees(values) if _is_angle(surface, name) else values


def _unit(surface: Surface, name: str) -> str:
    """The unit of parameter 'u' or 'v' in a figure."""
    return "degrees" if _is_angle(surface, name) else "m"


def _is_angle(surface: Surface, name: str) -> bool:
    """True where parameter 'u' or 'v' is in radians."""
    return surface.units["uv".index(name)] == "rad"


def _turn(cells: Cells, name: str) -> float:
    """A full turn of parameter 'u' or 'v' where the patch closes on itself, degrees; else inf."""
    return 360.0 if getattr(cells.surface, f"{name}_closed") else np.inf


def _bin(values: NDArray[np.float64], limits: tuple[float, float], count: int) -> Any:
    """Which of `count` equal parts of a range each value falls in."""
    share = (values - limits[0]) / (limits[1] - limits[0])
    return np.clip(np.floor(share * count), 0, count - 1).astype(np.int64)


def _name(cells: Cells, cell: int) -> str:
    """A cell as (row, column)."""
    i, j = cells.unravel(cell)
    return f"({i}, {j})"


def _joint_label(verdict: Verdict, joint: int) -> str:
    """A joint's name with its unit; a dollar sign in it is no mathematics."""
    name = verdict.robot.joint_names[joint].replace("$", r"\$")
    return f"{name} ({'mm' if verdict.robot.prismatic[joint] else 'degrees'})"
