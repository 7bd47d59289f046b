"""Which configuration to take over each cell of a route, so that the joints travel least.

After each cell the best few nodes over it are kept, each with the cheapest path to it. Where no
single motion leads on, all of the path until there may have to be run one turn of a joint earlier
(`windings`); else the cheapest path through the known motions leads on, over cells visited again.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import networkx as nx
import numpy as np

from coverable.arrays import Ints
from feasibility.paths.motion_graph import (
    MotionGraph,
    join_self_motions,
    rewound,
    step_to,
    windings,
)
from feasibility.paths.order import PathError
from surfaces.cells import Cells

KEPT = 4  # nodes that are kept over each cell of the route
APART = 0.1  # [rad] or [m], a node nearer to a cheaper one than this is a copy of it
FEWEST = 2  # nodes that are kept even where they are copies
REVISIT = 20.0  # [rad], what a detour as long as the arm costs; revisits are expensive
START, GOAL = -1, -2  # nodes before those that a detour begins at, and behind those it ends at


@dataclass(frozen=True, eq=False, slots=True)
class _State:
    """A node over the present cell of the route, and the cheapest path to it."""

    node: int
    cost: float
    """rad, travel of the joints until here."""
    nodes: tuple[int, ...]
    """Nodes from the last state on, the last one is `node`."""
    before: "_State | None"

    @property
    def onward(self) -> tuple[int, ...]:
        """The node of the last state, and `nodes`."""
        return self.nodes if self.before is None else (self.before.node, *self.nodes)


@dataclass(frozen=True, eq=False, slots=True)
class JointRoute:
    """The nodes of one continuous motion, consecutive ones joined by a motion of the graph."""

    graph: MotionGraph
    nodes: list[int]
    revisited: float
    """m, straight from centre to centre, of the part that leads to cells visited before."""
    travel: float
    """rad, length of the motion in joint space."""
    stuck: list[int]
    """Cells to which no single motion led, so that others were visited again."""

    @property
    def rank(self) -> tuple[float, float]:
        """What is less is better."""
        return round(self.revisited, 9), self.travel


def joint_route(
    graph: MotionGraph,
    cells: Cells,
    route: Ints,
    *,
    wind: bool = True,
    most_revisited: float = math.inf,
) -> JointRoute:
    """One continuous motion that visits the cells of a route in turn.

    Args:
        graph: the known motions; those that are made meanwhile are added.
        cells, route: the cells, and flat indices of them, each once.
        wind: whether the path may be run full turns of a joint earlier or later than known motions
            are.
        most_revisited: m, of more than this the path is given up; without nodes, then, and with
            infinite figures.

    Raises:
        PathError: no motion leads on from a cell.
    """
    states = [_State(x, 0.0, (x,), None) for x in graph.over[int(route[0])]]
    seen = {int(route[0])}
    stuck, again = [], 0.0
    for cell in route[1:].tolist():
        if cell in seen:
            continue  # on a detour
        onward = _steps(graph, states, cell)
        if not onward and wind:
            onward = _steps(graph, _wound(graph, states, cell), cell)
        if onward:
            seen.add(cell)
            states = onward
            continue
        stuck.append(cell)
        detour = _detour(graph, cells, states, cell)
        if detour is None:
            here, there = (list(cells.unravel(c)) for c in (graph.cell[states[0].node], cell))
            raise PathError(f"no known motion leads from cell {here} to cell {there}")
        again += _revisited(graph, cells, detour.onward, seen)
        if again > most_revisited:
            return JointRoute(graph, [], math.inf, math.inf, stuck)
        seen.update(graph.cell[x] for x in detour.nodes)
        states = [detour]
    nodes = _unrolled(min(states, key=lambda state: state.cost))
    travel = sum(graph.length(x, y) for x, y in pairwise(nodes))
    return JointRoute(graph, nodes, _revisited(graph, cells, nodes), travel, stuck)


def _revisited(
    graph: MotionGraph, cells: Cells, nodes: Sequence[int], seen: Iterable[int] = ()
) -> float:
    """m, straight from centre to centre, how much of a motion leads to cells visited before."""
    known, total = {graph.cell[nodes[0]], *seen}, 0.0
    for x, y in pairwise(nodes):
        if graph.cell[y] in known:
            step = cells.centres[graph.cell[x]] - cells.centres[graph.cell[y]]
            total += float(np.linalg.norm(step))
        known.add(graph.cell[y])
    return total


def _steps(graph: MotionGraph, states: list[_State], cell: int) -> list[_State]:
    """The best few states over the next cell that single motions lead to."""
    if not states or not graph.touch(graph.cell[states[0].node], cell):
        return []
    best: dict[int, _State] = {}
    for state in states:
        for y in step_to(graph, state.node, cell):
            cost = state.cost + graph.length(state.node, y)
            if y not in best or cost < best[y].cost:
                best[y] = _State(y, cost, (y,), state)
    kept: list[_State] = []
    copies: list[_State] = []
    for state in sorted(best.values(), key=lambda state: (state.cost, state.node)):
        q = graph.q[state.node]
        near = any(np.abs(graph.q[other.node] - q).max() < APART for other in kept)
        (copies if near else kept).append(state)
    return [*kept[:KEPT], *copies[: max(0, FEWEST - len(kept))]]


def _wound(graph: MotionGraph, states: list[_State], cell: int) -> list[_State]:
    """The states in other windings of all the path to them, where that leads on."""
    if not graph.touch(graph.cell[states[0].node], cell):
        return []
    found = []
    for state in states:
        nodes = _unrolled(state)
        for winding in windings(graph, nodes):
            end = graph.node(graph.cell[state.node], graph.q[state.node] + winding)
            if step_to(graph, end, cell):
                found.append(_State(end, state.cost, tuple(rewound(graph, nodes, winding)), None))
    return found


def _detour(graph: MotionGraph, cells: Cells, states: list[_State], cell: int) -> _State | None:
    """The cheapest path through the known motions to a node over a cell; None if there is none."""
    for state in states:
        join_self_motions(graph, state.node)

    def cost(x: int, y: int, edge: dict[str, float]) -> float:
        if "cost" in edge:
            return edge["cost"]
        apart = np.linalg.norm(cells.centres[graph.cell[x]] - cells.centres[graph.cell[y]])
        return edge["length"] + REVISIT * float(apart) / graph.arrays.scale

    edges = graph.edges
    edges.add_weighted_edges_from(((START, s.node, s.cost) for s in states), "cost")
    edges.add_weighted_edges_from(((x, GOAL, 0.0) for x in graph.over[cell]), "cost")
    try:
        total, nodes = nx.single_source_dijkstra(edges, START, GOAL, weight=cost)
    except nx.NetworkXNoPath:
        return None
    finally:
        edges.remove_nodes_from((START, GOAL))
    first = next(state for state in states if state.node == nodes[1])
    return _State(nodes[-2], total, tuple(nodes[2:-1]), first)


def _unrolled(state: _State | None) -> list[int]:
    """All nodes on the path to a state."""
    parts: list[tuple[int, ...]] = []
    while state is not None:
        parts.append(state.nodes)
        state = state.before
    return [x for part in reversed(parts) for x in part]
