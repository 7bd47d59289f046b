"""The largest speed of known motions, by timing them: no bound, no code of the judge's."""

from __future__ import annotations

import networkx as nx
import numpy as np

from feasibility import Task, check
from feasibility.clock import Clock
from feasibility.speed.rated_graph import grow, rated_graph
from robots import Kinematics

PLACES = 12  # at which a segment is timed
NEAR = 0.1  # [1] share of the tolerance within which the tool is in place


def runs_at(robot, targets, near, q, speed):
    """Is a motion inside the velocity limits, timed so that the tool has this speed?"""
    kinematics = Kinematics(robot)
    points, _ = kinematics.tools(q)
    for k in range(len(q) - 1):
        away = np.linalg.norm(targets - points[k], axis=1)
        if max(away.min(), np.linalg.norm(points[k + 1] - targets[away.argmin()])) <= near:
            continue
        way = q[k + 1] - q[k]
        for share in np.linspace(0.0, 1.0, PLACES):
            rate = np.linalg.norm(kinematics.jacobians(q[k] + share * way)[0] @ way)
            if (np.abs(way) * speed > robot.max_velocity * rate).any():
                return False
    return True


def fastest(robot, targets, near, q):
    """m/s, by bisection."""
    low, high = 0.0, 50.0
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        if runs_at(robot, targets, near, q, middle):
            low = middle
        else:
            high = middle
    return low


def largest(robot, cells, task: Task):
    """m/s: the speed at which the motions that hold it stop joining all cells."""
    verdict = check(robot, cells, task)
    rated = rated_graph(verdict)
    grow(rated, Clock())
    targets, near = task.targets(cells).points, NEAR * task.effective_tolerance
    graph = nx.Graph()
    graph.add_nodes_from(range(len(rated.graph.cell)))
    speeds = {
        edge: fastest(robot, targets, near, rated.graph.motion(*edge))
        for edge in rated.graph.edges.edges
    }
    for (x, y), speed in sorted(speeds.items(), key=lambda item: -item[1]):
        graph.add_edge(x, y)
        part = nx.node_connected_component(graph, x)
        if len({rated.graph.cell[z] for z in part}) == len(cells):
            return speed
    return 0.0
