"""Which configuration to take over each cell of a route, so that the joints travel least.

Dynamic programming over (cell, node): after each cell the best few nodes over it are kept, each
with the cheapest way there. Where no single motion leads on, the whole path until there may have to
be run one turn of a joint earlier (`whole_turns`); else the cheapest way through the known motions
leads on, over cells that are then visited again.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from itertools import count, pairwise

import numpy as np
from numpy.typing import NDArray

from feasibility.paths.motion_graph import MotionNet
from feasibility.paths.motion_links import step_to, turn_at
from feasibility.paths.order import PathError
from feasibility.paths.windings import turned, whole_turns
from feasibility.verdict import Walk
from surfaces import Cells

KEPT = 4  # nodes that are kept over each cell of the route
APART = 0.1  # [rad] or [m], a node nearer to a cheaper one than this is a copy of it
FEWEST = 2  # nodes that are kept even where they are copies
REVISIT = 20.0  # [rad], what a detour as long as the arm costs; revisits are dear


@dataclass(frozen=True, eq=False, slots=True)
class _State:
    """A node over the present cell of the route, and the cheapest way there."""

    node: int
    cost: float
    """rad, travel of the joints until here."""
    nodes: tuple[int, ...]
    """Nodes from the last state on, the last one is `node`."""
    before: _State | None


@dataclass(frozen=True, eq=False, slots=True)
class JointRoute:
    """The nodes of one continuous motion, consecutive ones joined by a motion of the net."""

    net: MotionNet
    nodes: list[int]
    length: float
    """m, straight from centre to centre."""
    revisited: float
    """m, the part of it that leads to cells visited before."""
    travel: float
    """rad, length of the motion in joint space."""
    stuck: list[int]
    """Cells to which no single motion led, so that others were visited again."""


def joint_route(
    net: MotionNet,
    cells: Cells,
    route: NDArray[np.int64],
    *,
    turns: bool = True,
    most_revisited: float = math.inf,
) -> JointRoute:
    """One continuous motion that visits the cells of a route in turn.

    Args:
        net: the known motions; those that are made on the way are added.
        cells: the cells.
        route: flat indices of cells, each once.
        turns: whether the path may be run a whole turn of a joint earlier or later than known
            motions are.
        most_revisited: m, of more than this the path is given up.

    Returns:
        The motion; without nodes and of infinite length where it was given up.

    Raises:
        PathError: no configuration over a cell is known, or no motion leads there.
    """
    missing = [int(c) for c in route if not net.over.get(int(c))]
    if missing:
        raise PathError(f"no motion leads to {_names(cells, missing)}")
    states = [_State(x, 0.0, (x,), None) for x in net.over[int(route[0])]]
    seen = {int(route[0])}
    stuck, again = [], 0.0
    for cell in route[1:].tolist():
        if cell in seen:
            continue  # on a detour
        onward = _steps(net, states, cell)
        if not onward and turns:
            onward = _steps(net, _turned(net, states, cell), cell)
        if onward:
            seen.add(cell)
            states = onward
            continue
        stuck.append(cell)
        detour = _detour(net, cells, states, cell)
        if detour is None:
            here = cells.unravel(net.cell[states[0].node])
            raise PathError(
                f"no known motion leads from cell {list(here)} to {_names(cells, [cell])}"
            )
        again += _revisited(net, cells, detour, seen)
        if again > most_revisited:
            return JointRoute(net, [], math.inf, math.inf, math.inf, stuck)
        seen.update(net.cell[x] for x in detour.nodes)
        states = [detour]
    return measured(net, cells, _unrolled(min(states, key=lambda state: state.cost)), stuck)


def measured(net: MotionNet, cells: Cells, nodes: list[int], stuck: list[int]) -> JointRoute:
    """A motion from node to node with its lengths."""
    seen = {net.cell[nodes[0]]}
    length = revisited = travel = 0.0
    for x, y in pairwise(nodes):
        away = float(np.linalg.norm(cells.centres[net.cell[x]] - cells.centres[net.cell[y]]))
        length += away
        revisited += away if net.cell[y] in seen else 0.0
        travel += net.lengths[x][y]
        seen.add(net.cell[y])
    return JointRoute(net, nodes, length, revisited, travel, stuck)


def _revisited(net: MotionNet, cells: Cells, detour: _State, seen: set[int]) -> float:
    """m, how much of a detour leads to cells visited before."""
    nodes = list(detour.nodes) if detour.before is None else [detour.before.node, *detour.nodes]
    known, total = set(seen), 0.0
    for x, y in pairwise(nodes):
        if net.cell[y] in known:
            away = cells.centres[net.cell[x]] - cells.centres[net.cell[y]]
            total += float(np.linalg.norm(away))
        known.add(net.cell[y])
    return total


def _steps(net: MotionNet, states: list[_State], cell: int) -> list[_State]:
    """The best few states over the next cell that single motions lead to."""
    if not states or not net.touch(net.cell[states[0].node], cell):
        return []
    best: dict[int, _State] = {}
    for state in states:
        for y in step_to(net, state.node, cell):
            cost = state.cost + net.lengths[state.node][y]
            if y not in best or cost < best[y].cost:
                best[y] = _State(y, cost, (y,), state)
    kept: list[_State] = []
    copies: list[_State] = []
    for state in sorted(best.values(), key=lambda state: (state.cost, state.node)):
        q = net.q[state.node]
        near = any(np.abs(net.q[other.node] - q).max() < APART for other in kept)
        (copies if near else kept).append(state)
    return [*kept[:KEPT], *copies[: max(0, FEWEST - len(kept))]]


def _turned(net: MotionNet, states: list[_State], cell: int) -> list[_State]:
    """States as they are if all the way there is turned by whole turns, where that leads on."""
    if not net.touch(net.cell[states[0].node], cell):
        return []
    found = []
    for state in states:
        nodes = _unrolled(state)
        for turn in whole_turns(net, nodes):
            end = net.node(net.cell[state.node], net.q[state.node] + turn)
            if step_to(net, end, cell):
                found.append(_State(end, state.cost, tuple(turned(net, nodes, turn)), None))
    return found


def _detour(net: MotionNet, cells: Cells, states: list[_State], cell: int) -> _State | None:
    """The cheapest way through the known motions to a node over a cell; None if there is none."""
    for state in states:
        turn_at(net, state.node)
    order = count()
    cheapest: dict[int, float] = {}
    came: dict[int, int] = {}
    first: dict[int, _State] = {}
    heap: list[tuple[float, int, int]] = []
    for state in states:
        cheapest[state.node], first[state.node] = state.cost, state
        heapq.heappush(heap, (state.cost, next(order), state.node))
    while heap:
        cost, _, x = heapq.heappop(heap)
        if cost > cheapest[x]:
            continue
        if net.cell[x] == cell:
            nodes = [x]
            while nodes[-1] in came:
                nodes.append(came[nodes[-1]])
            start = first[nodes.pop()]
            return _State(x, cost, tuple(reversed(nodes)), start)
        for y, length in net.lengths[x].items():
            apart = np.linalg.norm(cells.centres[net.cell[x]] - cells.centres[net.cell[y]])
            dear = cost + length + REVISIT * float(apart) / net.problem.scale
            if dear < cheapest.get(y, np.inf):
                cheapest[y], came[y] = dear, x
                heapq.heappush(heap, (dear, next(order), y))
    return None


def _unrolled(state: _State | None) -> list[int]:
    """All nodes on the way to a state."""
    parts: list[tuple[int, ...]] = []
    while state is not None:
        parts.append(state.nodes)
        state = state.before
    return [x for part in reversed(parts) for x in part]


def walk_of(net: MotionNet, nodes: list[int]) -> Walk:
    """The motion from node to node, marked where it is over a cell's centre."""
    q, cell = [net.q[nodes[0]][None]], [np.array([net.cell[nodes[0]]])]
    for x, y in pairwise(nodes):
        motion = net.links[x][y]
        q.append(motion[1:])
        marks = np.full(len(motion) - 1, -1)
        marks[-1] = net.cell[y]
        cell.append(marks)
    return Walk(q=np.vstack(q), cell=np.concatenate(cell).astype(np.int64))


def _names(cells: Cells, which: list[int]) -> str:
    """Some cells by their rows and columns."""
    shown = ", ".join(str(list(cells.unravel(c))) for c in which[:5])
    more = f" and {len(which) - 5} more" if len(which) > 5 else ""
    return f"cell{'s' if len(which) > 1 else ''} {shown}{more}"
