"""Verdicts at a speed turn where timed motions do, with no bound and no code of the judge's."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import networkx as nx
import numpy as np
import pytest
from samples import sampled, seeds
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from coverable_errors import ArgumentError
from feasibility import Search, Task, check, verify
from feasibility.clock import Clock
from feasibility.speed import rate_figures
from feasibility.speed.rated_graph import grow, rated_graph
from robots import Kinematics, load_robot
from surfaces import cylinder, plane, sphere

UR5 = load_robot("ur5")
CELLS = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0, 0, 0.3)).cells(2, 2)
TASK = Task(standoff=0.02, cone_deg=20)
NEAR = 1e-4  # m of a target within which the tool is in place: a tenth of the tolerance
PLACES = 16  # at which a segment is looked at first


def fastest(robot, targets, q):
    """m/s, at which a motion can be timed: on each segment the least that any place of it allows.

    Around the place that allows least of those looked at, the least is searched for.
    """
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


ARMS = ("ur5", "panda", "puma560", "kinova")


@cache
def drawn(seed):
    """The verdict over cells around a random place that an arm reaches."""
    rng = np.random.default_rng(seed)
    robot = load_robot(ARMS[seed % 4])
    robot = replace(robot, max_velocity=rng.uniform(0.5, 3.0, robot.n))
    low, high = np.maximum(robot.lower, -2.5), np.minimum(robot.upper, 2.5)
    for _ in range(20):
        point, axis = Kinematics(robot).tool(rng.uniform(low, high))
        x = np.cross(axis, rng.normal(size=3))
        x /= np.linalg.norm(x)
        turn = Rotation.from_matrix(np.column_stack([x, np.cross(-axis, x), -axis]))
        lying = turn * Rotation.from_euler("y", 90, degrees=True)
        rpy, flat = (tuple(one.as_euler("xyz", degrees=True)) for one in (turn, lying))
        at, size = point + TASK.standoff * axis, rng.uniform(0.04, 0.12)
        centre, angle = tuple(at + 0.3 * axis), np.degrees(size / 0.3)
        part = (
            plane((-size, size), (-size, size), "outside", tuple(at), rpy),
            sphere(0.3, (1, angle), (0, 90), "outside", centre, rpy),
            cylinder(0.3, (180 - angle, 180 + angle), (-size, size), "outside", centre, flat),
        )[seed % 3]
        verdict = check(robot, part.cells(2, 2), TASK)
        if verdict.feasible:
            return verdict
    raise AssertionError("no patch of twenty is covered")


@sampled
@pytest.mark.parametrize("seed", seeds(2, all=24))
def test_the_verdict_turns_where_timed_motions_do(seed):
    plain = drawn(seed)
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


@cache
def asked(**changes):
    return check(UR5, CELLS, replace(TASK, **changes))


@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_a_motion_too_fast_for_its_joints_does_not_verify(factor):
    verdict = asked()
    most = rate_figures(verdict, more=False).witness.speed
    found = verify(UR5, CELLS, replace(TASK, speed=factor * most), verdict.witness.q)
    assert found.holds == (factor < 1.0)
    assert found.holds or "would need" in found.refusal


def test_where_nothing_is_asked_nothing_changes():
    plain, slow = asked(), asked(speed=0.01)
    assert slow.statistics == plain.statistics
    assert np.array_equal(slow.witness.q, plain.witness.q)
    assert slow.message.startswith(plain.message)
    assert plain.certificate.max_speed is None


def test_singular_values_are_kept_above_what_is_asked():
    least = rate_figures(asked(), more=False).witness.sigma
    inside = asked(min_manipulability=0.95 * least)
    assert inside.feasible
    assert inside.certificate.min_singular_value >= 0.95 * least
    beyond = asked(min_manipulability=5.0 * least)
    assert str(beyond.answer) == "undecided"
    assert "smallest singular value is" in beyond.message


def test_a_motion_that_never_moves_is_judged_where_it_stands():
    cells = CELLS.surface.cells(1, 1)
    still = check(UR5, cells, replace(TASK, speed=0.2, min_manipulability=1e-3))
    assert len(still.witness.q) == 1
    assert 1e-3 <= still.certificate.min_singular_value < 1.0
    assert "0.2 m/s all along it inside the joints' velocities." in still.message
    beyond = check(UR5, cells, replace(TASK, min_manipulability=0.99))
    assert str(beyond.answer) == "undecided"


def test_bad_questions_are_refused():
    for robot, speed, words, *search in (
        (UR5, 1e4, "m/s anywhere"), (UR5, 0.1, "complete search", Search(method="greedy")),
        (replace(UR5, max_velocity=np.nan), 0.1, "limits no velocity"),
    ):  # fmt: skip
        with pytest.raises(ArgumentError, match=words):
            check(robot, CELLS, replace(TASK, speed=speed), *search)
    for bad in ({"speed": 0.0}, {"speed": "fast"}, {"min_manipulability": -1.0}):
        with pytest.raises(ArgumentError, match=next(iter(bad))):
            replace(TASK, **bad)
