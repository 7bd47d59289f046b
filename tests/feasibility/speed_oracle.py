"""The largest speed of known motions, by timing them: no bound, no code of the judge's."""

from __future__ import annotations

import networkx as nx
import numpy as np
from scipy.optimize import minimize_scalar

from feasibility import Task, check
from feasibility.clock import Clock
from feasibility.speed.rated_graph import grow, rated_graph
from robots import Kinematics

PLACES = 16  # at which a segment is looked at first
NEAR = 0.1  # [1] share of the tolerance within which the tool is in place


def fastest(robot, targets, near, q):
    """m/s, at which a motion can be timed: on each segment the least that any place of it allows.

    Around the place that allows least of those looked at, the least is searched for.
    """
    kinematics = Kinematics(robot)
    points, _ = kinematics.tools(q)
    speeds = [np.inf]
    for k in range(len(q) - 1):
        away = np.linalg.norm(targets - points[k], axis=1)
        if max(away.min(), np.linalg.norm(points[k + 1] - targets[away.argmin()])) <= near:
            continue
        way = q[k + 1] - q[k]
        time = np.max(np.abs(way) / robot.max_velocity)

        def allowed(share, way=way, time=time, start=q[k]):
            return np.linalg.norm(kinematics.jacobians(start + share * way)[0] @ way) / time

        if time > 0.0:
            shares = np.linspace(0.0, 1.0, PLACES)
            values = [allowed(share) for share in shares]
            least = int(np.argmin(values))
            around = shares[max(least - 1, 0)], shares[min(least + 1, PLACES - 1)]
            dip = minimize_scalar(allowed, bounds=around, method="bounded", options={"xatol": 1e-9})
            speeds.append(min(values[least], dip.fun))
    return min(speeds)


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
