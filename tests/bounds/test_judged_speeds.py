"""Verdicts at a speed turn where timed motions do, with no bound and no code of the judge's."""

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from samples import sampled, spread
from scipy.optimize import minimize_scalar

from coverable import Task, check, load_robot, plane, sphere, verify
from feasibility.clock import Clock
from feasibility.speed.largest import rate_figures
from feasibility.speed.rated_graph import grow, rated_graph
from robots.kinematics import Kinematics

UR5 = load_robot("ur5")
CELLS = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0, 0, 0.3)).cells(2, 2)
DOME = sphere(0.3, (1, 20), (0, 90), "outside", (0.5, 0, 0.1)).cells(2, 2)
TASK = Task(standoff=0.02, cone_deg=20)
ARM = replace(UR5, max_velocity=np.linspace(0.6, 2.6, 6))
NEAR = 1e-4  # m of a target within which the tool is in place: a tenth of the tolerance
PLACES = 16  # at which a segment is looked at first


def fastest(robot, targets, q):
    """m/s, at which a motion can be timed: the least that any place of a segment allows."""
    kinematics, speeds = Kinematics(robot), [np.inf]
    points, _ = kinematics.tools(q)
    for k, (start, way) in enumerate(zip(q, np.diff(q, axis=0), strict=False)):
        away = np.linalg.norm(targets - points[k], axis=1)
        if max(away.min(), np.linalg.norm(points[k + 1] - targets[away.argmin()])) <= NEAR:
            continue
        time = np.max(np.abs(way) / robot.max_velocity)

        def allowed(share, way=way, time=time, start=start):
            return np.linalg.norm(kinematics.jacobians(start + share * way)[0] @ way) / time

        if time > 0.0:
            shares = np.linspace(0.0, 1.0, PLACES)
            values = [allowed(share) for share in shares]
            least = int(np.argmin(values))
            around = shares[max(least - 1, 0)], shares[min(least + 1, PLACES - 1)]
            dip = minimize_scalar(allowed, bounds=around, method="bounded", options={"xatol": 1e-9})
            speeds.append(min(values[least], dip.fun))
    return min(speeds)


def largest(verdict):
    """m/s: the speed at which the motions that hold it stop joining all cells."""
    rated = rated_graph(verdict)
    grow(rated, Clock())
    targets = verdict.task.targets(verdict.cells).points
    graph = nx.Graph()
    graph.add_nodes_from(range(len(rated.graph.cell)))
    speeds = {
        edge: fastest(verdict.robot, targets, rated.graph.motion(*edge))
        for edge in rated.graph.edges.edges
    }
    for (x, y), speed in sorted(speeds.items(), key=lambda item: -item[1]):
        graph.add_edge(x, y)
        part = nx.node_connected_component(graph, x)
        if len({rated.graph.cell[z] for z in part}) == len(verdict.cells):
            return speed
    return 0.0


@sampled("cells", spread([DOME, CELLS], 1))
def test_the_verdict_turns_where_timed_motions_do(cells):
    plain = check(ARM, cells, TASK)
    robot, cells, turn = plain.robot, plain.cells, largest(plain)
    slower, faster = (check(robot, cells, replace(TASK, speed=f * turn)) for f in (0.98, 1.02))
    assert slower.feasible
    assert slower.certificate.max_speed >= 0.98 * turn
    assert verify(slower).holds
    assert fastest(robot, TASK.targets(cells).points, slower.witness.q) >= 0.98 * turn
    assert str(faster.answer) == "undecided"
    assert faster.n_covered < len(cells)
    assert all("would need" in cause.detail for cause in faster.causes)
    known = float(faster.message.split("covered at ")[1].split()[0])
    assert known == pytest.approx(turn, rel=0.02)
    assert rate_figures(plain).largest == pytest.approx(turn, rel=0.02)
