"""The roadmap of a toolpath as layers, one for each pose: what can be run without going back.

A motion of the roadmap leads from a node over one pose to a node over the next, or stays over one
pose. So a run in order is a path through the layers; the one with the fewest changes of posture in
place is taken, and among those one with the fewest waypoints.
"""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np

from feasibility.roadmap.graph import EDGES, NODES, Roadmap

IN_PLACE = 1e6  # [waypoints] a change of posture in place counts as much


class Layers(NamedTuple):
    """How far a run from the first pose gets."""

    ahead: frozenset[int]
    """Nodes that a run reaches."""
    furthest: int
    """The last pose that a run reaches; -1 where there is none over the first."""
    start: int
    """The node at which the best run to that pose begins, -1 where there is none."""
    route: tuple[int, ...]
    """Its edges, + 1, negative where one is run backwards."""


def layers_of(roadmap: Roadmap, begin: int | None = None) -> Layers:
    """The best run from the first pose to the last one that any run reaches.

    Args:
        roadmap: the roadmap.
        begin: the node that it has to begin at; any over the first pose by default.
    """
    cell = roadmap.cell[: roadmap.counters[NODES]].tolist()
    steps = _steps(roadmap, cell)
    starts = [x for x, over in enumerate(cell) if over == 0] if begin is None else [begin]
    cost, came = _cheapest(starts, steps)
    if not cost:
        return Layers(frozenset(), -1, -1, ())
    end = min(cost, key=lambda x: (-cell[x], cost[x]))
    route, here = list[int](), end
    while here in came:
        edge, here = came[here]
        route.append(edge)
    return Layers(
        ahead=frozenset(cost),
        furthest=cell[end],
        start=here,
        route=tuple(reversed(route)),
    )


def _steps(roadmap: Roadmap, cell: list[int]) -> list[list[tuple[int, int, float]]]:
    """From each node those it leads to: the signed edge + 1, the node, and what it costs."""
    found: list[list[tuple[int, int, float]]] = [[] for _ in cell]
    count = roadmap.counters[EDGES]
    rows = roadmap.edge_rows[:count, 1].tolist()
    for edge, (x, y) in enumerate(roadmap.ends[:count].tolist()):
        cost = rows[edge] + (IN_PLACE if cell[x] == cell[y] else 0.0)
        if cell[y] - cell[x] in (0, 1):
            found[x].append((edge + 1, y, cost))
        if cell[x] - cell[y] in (0, 1):
            found[y].append((-edge - 1, x, cost))
    return found


def _cheapest(
    starts: list[int], steps: list[list[tuple[int, int, float]]]
) -> tuple[dict[int, float], dict[int, tuple[int, int]]]:
    """Of all nodes that are reached the least cost, and the last step there."""
    cost = dict.fromkeys(starts, 0.0)
    came: dict[int, tuple[int, int]] = {}
    queue = [(0.0, x) for x in starts]
    done = np.zeros(len(steps), dtype=bool)
    while queue:
        spent, x = heapq.heappop(queue)
        if done[x]:
            continue
        done[x] = True
        for edge, y, more in steps[x]:
            if spent + more < cost.get(y, np.inf):
                cost[y] = spent + more
                came[y] = edge, x
                heapq.heappush(queue, (spent + more, y))
    return cost, came
