"""Motions made on demand from a configuration over one cell to a neighbouring cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.paths.motion_graph import MotionNet
from feasibility.roadmap import CONNECT_STEPS, MOST_STEPS, connect, track

GOALS = 2  # nodes over the next cell that are headed for, besides those that are joined already
TURNS = 6  # nodes over one cell that a self-motion is tried to
# [rad] or [m]: arrivals nearer to a known node than this are it, if a motion joins them.
SAME = 1e-3


def step_to(net: MotionNet, x: int, cell: int) -> list[int]:
    """Nodes over a neighbouring cell that one motion from node x reaches.

    Besides the motions that are known, the surface is followed freely, keeping away from limits
    and the rim of the cone, and towards the nearest nodes that are known there.
    """
    found = [y for y in net.links[x] if net.cell[y] == cell]
    near = [y for y in _nearest(net, cell, net.q[x]) if y not in found]
    found += [y for y in near[:GOALS] if _head_for(net, x, y)]
    free = _follow(net, x, cell, None)
    if free is not None:
        known = _nearest(net, cell, free[-1])[:1]
        if not any(np.abs(net.q[y] - free[-1]).max() < SAME and y in found for y in known):
            y = net.node(cell, free[-1])
            net.link(x, y, free)
            found.append(y)
    return found


def turn_at(net: MotionNet, x: int) -> None:
    """Join a node with the nearest others over its cell, where a self-motion does."""
    for y in _nearest(net, net.cell[x], net.q[x])[:TURNS]:
        if y == x or y in net.links[x]:
            continue
        for a, b in ((x, y), (y, x)):
            motion = _self_motion(net, net.cell[x], net.q[a], net.q[b])
            if motion is not None:
                net.link(a, b, motion)
                break


def _nearest(net: MotionNet, cell: int, q: NDArray[np.float64]) -> list[int]:
    """Nodes over a cell, the nearest to q first."""
    nodes = net.over.get(cell, [])
    away = [float(np.abs(net.q[y] - q).sum()) for y in nodes]
    return [nodes[k] for k in np.argsort(away, kind="stable")]


def _head_for(net: MotionNet, x: int, y: int) -> bool:
    """Join x with a node over a neighbouring cell; True where a motion does."""
    motion = _follow(net, x, net.cell[y], net.q[y])
    if motion is None:
        return False
    turn = _self_motion(net, net.cell[y], motion[-1], net.q[y])
    if turn is None:
        return False
    arrival = net.node(net.cell[y], motion[-1])
    net.link(x, arrival, motion)
    net.link(arrival, y, turn)
    if arrival != y:
        net.link(x, y, np.vstack([motion, turn[1:]]))
    return True


def _follow(
    net: MotionNet, x: int, cell: int, goal: NDArray[np.float64] | None
) -> NDArray[np.float64] | None:
    """(k, n) waypoints along the surface from x to a neighbouring cell's centre; None if stuck."""
    q = net.q[x].copy()
    rows = np.empty((MOST_STEPS + 1, len(q)))
    here = net.cell[x]
    # A course runs from the cell of lower index to the other.
    begin, end = (0.0, 1.0) if here < cell else (1.0, 0.0)
    count = track(
        net.problem, net.work, net.pairs[min(here, cell), max(here, cell)], begin, end, q,
        q if goal is None else goal, goal is not None, rows, 0,
    )  # fmt: skip
    return None if count < 0 else np.vstack([net.q[x][None], rows[:count]])


def _self_motion(
    net: MotionNet, cell: int, start: NDArray[np.float64], goal: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """(k, n) waypoints over one cell's centre from start to goal; None where none was found."""
    if np.array_equal(start, goal):
        return start[None].copy()
    q = start.copy()
    rows = np.empty((CONNECT_STEPS + 1, len(q)))
    problem = net.problem
    count, reached = connect(
        problem, net.work, problem.points[cell], problem.approaches[cell], q, goal, rows, 0,
        CONNECT_STEPS,
    )  # fmt: skip
    return np.vstack([start[None], rows[:count]]) if reached else None
