"""Where components meet between cell centres.

Two sheets of configurations (two flips of a wrist, say) may touch only where the arm passes a
singularity, and that place may lie between the centres. So two nodes over neighbouring cells are
both followed to a place on the way between their centres, and a self-motion is tried there.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap.arrays import SearchArrays, Work, aim
from feasibility.roadmap.expansion import CONNECT_STEPS
from feasibility.roadmap.graph import NODES, WAYPOINTS, Roadmap, add_edge, root_of, unite
from feasibility.roadmap.self_motion import connect
from feasibility.roadmap.tracking import MOST_STEPS, track

NARROWEST, WIDEST = 0.1, 0.9  # [1] share of the way between two centres where a meeting is tried
Room = Callable[[int], Roadmap]
"""Makes sure that so many rows of `waypoints` and an edge fit, and returns the roadmap."""


def nearest_pairs(
    roadmap: Roadmap, pairs: NDArray[np.int64], one: int, other: int
) -> NDArray[np.int64]:
    """(k, 2) nodes of two components over neighbouring cells, the nearest first.

    Near means that the motion from one to the other would do little to the tool, see
    `fibre.effects`; at a singularity two sheets are near though their joints are far apart.
    """
    nodes = np.arange(roadmap.counters[NODES])
    roots = np.array([root_of(roadmap, slot) for slot in range(len(roadmap.parent))])
    here = roots[roadmap.component[nodes]]
    held = []
    for component in (one, other):
        node = np.full(len(roadmap.first_node), -1)
        mine = nodes[here == component]
        node[roadmap.cell[mine]] = mine
        held.append(node)
    both = np.vstack([pairs, pairs[:, ::-1]])
    x, y = held[0][both[:, 0]], held[1][both[:, 1]]
    found = (x >= 0) & (y >= 0)
    x, y = x[found], y[found]
    effect = 0.5 * (roadmap.effect[x] + roadmap.effect[y])
    distance = (((roadmap.q[x] - roadmap.q[y]) * effect) ** 2).sum(axis=1)
    return np.column_stack([x, y])[np.argsort(distance, kind="stable")]


def bridge(
    arrays: SearchArrays, work: Work, room: Room, x: int, y: int, curve: int, share: float
) -> bool:
    """Try to join two nodes over neighbouring cells at a place between their centres.

    Args:
        problem: the problem.
        work: working memory.
        room: see `Room`.
        x: node over one cell.
        y: node over a neighbour of it.
        course: the course between the two cells.
        share: where on it.

    Returns:
        True when an edge was added and the components are one now.
    """
    roadmap = room(0)
    aim(arrays, work, curve, share)
    place, approach = work.target[0].copy(), work.target[1].copy()
    starts = (0.0, 1.0) if roadmap.cell[x] < roadmap.cell[y] else (1.0, 0.0)
    waypoints, ends = [], []
    for node, start in ((x, starts[0]), (y, starts[1])):
        q = roadmap.q[node].copy()
        rows = np.empty((MOST_STEPS + 1, len(q)))
        count = track(arrays, work, curve, start, share, q, q, False, rows, 0)
        if count < 0:
            return False
        waypoints.append(rows[:count])
        ends.append(q)
    turn = _self_motion(arrays, work, place, approach, ends)
    if turn is None:
        return False
    # From x to the place, the self-motion, and back along the way from y.
    motion = np.vstack([waypoints[0], turn, waypoints[1][-2::-1], roadmap.q[y][None]])
    roadmap = room(len(motion))
    first = roadmap.counters[WAYPOINTS]
    roadmap.waypoints[first : first + len(motion)] = motion
    add_edge(roadmap, x, y, len(motion))
    unite(roadmap, roadmap.component[x], roadmap.component[y])
    return True


def _self_motion(
    arrays: SearchArrays,
    work: Work,
    place: NDArray[np.float64],
    approach: NDArray[np.float64],
    ends: list[NDArray[np.float64]],
) -> NDArray[np.float64] | None:
    """(k, n) waypoints over one place from the first configuration to the second; None if none."""
    rows = np.empty((CONNECT_STEPS + 1, len(ends[0])))
    for a, b in ((0, 1), (1, 0)):
        q = ends[a].copy()
        count, reached = connect(arrays, work, place, approach, q, ends[b], rows, 0, CONNECT_STEPS)
        if reached and a == 0:
            return rows[:count]
        if reached:
            # Backwards: from the first one, over what lies before it, to the second one.
            return np.vstack([rows[: count - 1][::-1], ends[1][None]])
    return None
