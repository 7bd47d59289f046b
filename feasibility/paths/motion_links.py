"""Motions made on demand: to a neighbouring cell, over one cell, and in another winding.

A joint that may run over more than a full turn can do the same work from another turn. A path that
has got to the end of such a joint goes on if all of it is run one turn earlier.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from feasibility.paths.motion_graph import MotionGraph
from feasibility.roadmap import CONNECT_STEPS, MOST_STEPS, connect, track

GOALS = 2  # nodes over the next cell that are headed for, besides those that are joined already
NEAREST = 6  # nodes over one cell that a self-motion is tried to
TURN = 2.0 * math.pi
MOST_TURNS = 2  # full turns of one joint that are tried either way
# [rad] or [m]: arrivals nearer to a known node than this are it, if a motion joins them.
SAME = 1e-3


def step_to(graph: MotionGraph, x: int, cell: int) -> list[int]:
    """Nodes over a neighbouring cell that one motion from node x reaches.

    Besides the motions that are known, the surface is followed freely, keeping away from limits
    and the boundary of the cone, and towards the nearest nodes that are known there.
    """
    found = [y for y in graph.edges.neighbors(x) if graph.cell[y] == cell]
    near = [y for y in _nearest(graph, cell, graph.q[x]) if y not in found]
    found += [y for y in near[:GOALS] if _head_for(graph, x, y)]
    free = _follow(graph, x, cell, None)
    if free is not None:
        known = _nearest(graph, cell, free[-1])[:1]
        if not any(np.abs(graph.q[y] - free[-1]).max() < SAME and y in found for y in known):
            y = graph.node(cell, free[-1])
            graph.join(x, y, free)
            found.append(y)
    return found


def join_self_motions(graph: MotionGraph, x: int) -> None:
    """Join a node with the nearest others over its cell, where a self-motion does."""
    for y in _nearest(graph, graph.cell[x], graph.q[x])[:NEAREST]:
        if y == x or graph.edges.has_edge(x, y):
            continue
        for a, b in ((x, y), (y, x)):
            motion = _self_motion(graph, graph.cell[x], graph.q[a], graph.q[b])
            if motion is not None:
                graph.join(a, b, motion)
                break


def _nearest(graph: MotionGraph, cell: int, q: NDArray[np.float64]) -> list[int]:
    """Nodes over a cell, the nearest to q first."""
    nodes = graph.over.get(cell, [])
    away = [float(np.abs(graph.q[y] - q).sum()) for y in nodes]
    return [nodes[k] for k in np.argsort(away, kind="stable")]


def _head_for(graph: MotionGraph, x: int, y: int) -> bool:
    """Join x with a node over a neighbouring cell; True where a motion does."""
    motion = _follow(graph, x, graph.cell[y], graph.q[y])
    if motion is None:
        return False
    turn = _self_motion(graph, graph.cell[y], motion[-1], graph.q[y])
    if turn is None:
        return False
    arrival = graph.node(graph.cell[y], motion[-1])
    graph.join(x, arrival, motion)
    graph.join(arrival, y, turn)
    if arrival != y:
        graph.join(x, y, np.vstack([motion, turn[1:]]))
    return True


def _follow(
    graph: MotionGraph, x: int, cell: int, goal: NDArray[np.float64] | None
) -> NDArray[np.float64] | None:
    """(k, n) waypoints along the surface from x to a neighbouring cell's centre; None if stuck."""
    q = graph.q[x].copy()
    rows = np.empty((MOST_STEPS + 1, len(q)))
    here = graph.cell[x]
    # The curve between two cells runs from the one of lower index to the other.
    begin, end = (0.0, 1.0) if here < cell else (1.0, 0.0)
    count = track(
        graph.arrays, graph.work, graph.pairs[min(here, cell), max(here, cell)], begin, end, q,
        q if goal is None else goal, goal is not None, rows, 0,
    )  # fmt: skip
    return None if count < 0 else np.vstack([graph.q[x][None], rows[:count]])


def _self_motion(
    graph: MotionGraph, cell: int, start: NDArray[np.float64], goal: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """(k, n) waypoints over one cell's centre from start to goal; None where none was found."""
    if np.array_equal(start, goal):
        return start[None].copy()
    q = start.copy()
    rows = np.empty((CONNECT_STEPS + 1, len(q)))
    arrays = graph.arrays
    count, reached = connect(
        arrays, graph.work, arrays.points[cell], arrays.approaches[cell], q, goal, rows, 0,
        CONNECT_STEPS,
    )  # fmt: skip
    return np.vstack([start[None], rows[:count]]) if reached else None


def windings(graph: MotionGraph, nodes: list[int]) -> list[NDArray[np.float64]]:
    """(n,) each, rad: full turns of one joint that keep a motion inside the limits.

    Args:
        graph: the known motions.
        nodes: nodes, consecutive ones joined by a motion.
    """
    motions = [graph.q[nodes[0]][None], *(graph.motion(x, y) for x, y in pairwise(nodes))]
    lowest = np.min([motion.min(axis=0) for motion in motions], axis=0)
    highest = np.max([motion.max(axis=0) for motion in motions], axis=0)
    lower, upper = graph.arrays.lower, graph.arrays.upper
    found = []
    for joint in np.flatnonzero(~graph.arrays.chain.prismatic):
        for times in range(1, MOST_TURNS + 1):
            for by in (-times * TURN, times * TURN):
                winding = np.zeros(len(lowest))
                winding[joint] = by
                if lowest[joint] + by >= lower[joint] and highest[joint] + by <= upper[joint]:
                    found.append(winding)
    return found


def rewound(graph: MotionGraph, nodes: list[int], winding: NDArray[np.float64]) -> list[int]:
    """The nodes of the same motion in another winding, which is added to the graph."""
    moved = [graph.node(graph.cell[x], graph.q[x] + winding) for x in nodes]
    for (x, y), (a, b) in zip(pairwise(nodes), pairwise(moved), strict=True):
        graph.join(a, b, graph.motion(x, y) + winding)
    return moved
