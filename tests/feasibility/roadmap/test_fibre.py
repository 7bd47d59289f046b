"""Motions over one cell: certified all the way, and ending exactly where they say."""

from __future__ import annotations

import numpy as np
import pytest
from arm_urdfs import FREE, joint
from random_arms import QUESTIONS, finite_limits, question, robot_of, tools

from feasibility import Task, check
from feasibility.certification import replay
from feasibility.roadmap import Exploration, arrays_of, connect, margin_shares, work_for
from feasibility.roadmap.self_motion import settle
from feasibility.verdict import Walk
from surfaces import plane


@pytest.fixture(params=QUESTIONS)
def over_a_cell(request):
    """Robot, cells, task, problem, work, a cell, configurations on its fibre, and their room."""
    robot, cells, task = question(request.param)
    problem, work = arrays_of(robot, cells, task), work_for(robot.n)
    rng = np.random.default_rng(4)
    cell = len(cells) // 2
    guesses = rng.uniform(*finite_limits(robot), (60, robot.n))
    room = margin_shares(problem, work, cell, guesses)
    return robot, cells, task, problem, work, cell, guesses[room >= 0.0], room[room >= 0.0]


def refusal(robot, cells, task, q, cell):
    """Why the replay refuses a motion whose ends are over a cell; empty if it does not."""
    marks = np.full(len(q), -1)
    marks[[0, -1]] = cell
    return replay(robot, cells, task, Walk(q, marks), np.zeros(len(cells), dtype=bool)).refusal


def test_room_is_what_the_tightest_constraint_leaves(over_a_cell):
    """Configurations are on the fibre and inside the limits, and have the room that is stated."""
    robot, cells, task, _, _, cell, found, room = over_a_cell
    assert len(found) > 8
    target = task.targets(cells)
    points, axes = tools(robot, found)
    assert (np.linalg.norm(points - target.points[cell], axis=1) <= 0.02 * 1e-3 + 1e-12).all()
    chord = np.linalg.norm(axes - target.approaches[cell], axis=1)
    half = 0.5 * (robot.upper - robot.lower)
    free = np.minimum(found - robot.lower, robot.upper - found) / half
    expected = np.minimum(1.0 - chord / (2.0 * np.sin(task.cone / 2.0)), free.min(axis=1))
    np.testing.assert_allclose(room, expected, atol=1e-9)
    assert (expected >= -1e-12).all()


def test_connect_ends_exactly_at_its_goal(over_a_cell):
    """Between all pairs of ten configurations, and to places further along the same motion."""
    robot, cells, task, problem, work, cell, found, _ = over_a_cell
    ways = np.empty((200, robot.n))
    joined, halves, met = 0, 0, 0
    for a in found[:10]:
        for b in found[:10]:
            q = a.copy()
            rows, reached = connect(
                problem, work, problem.points[cell], problem.approaches[cell], q, b, ways, 3, 60
            )
            assert rows >= 0
            motion = np.vstack([a[None], ways[3 : 3 + rows]])
            assert (q == motion[-1]).all()
            assert reached == (rows > 0 and bool((motion[-1] == b).all()))
            assert not refusal(robot, cells, task, motion, cell)
            joined += reached
            if rows < 3 or reached:
                continue
            # Half of a motion that went somewhere can be made in one go, or in a few.
            goal = motion[len(motion) // 2]
            q = a.copy()
            rows, reached = connect(
                problem, work, problem.points[cell], problem.approaches[cell], q, goal, ways, 0, 60
            )
            assert not refusal(robot, cells, task, np.vstack([a[None], ways[:rows]]), cell)
            assert not reached or (ways[rows - 1] == goal).all()
            halves += 1
            met += reached
    assert joined >= 10
    assert met >= 0.8 * halves


def test_connect_says_when_there_is_no_room_for_waypoints(over_a_cell):
    """-2, and nothing is written beyond the end."""
    robot, _, _, problem, work, cell, found, _ = over_a_cell
    ways = np.full((5, robot.n), 7.0)
    q = found[0].copy()
    rows, reached = connect(
        problem, work, problem.points[cell], problem.approaches[cell], q, q.copy(), ways, 5, 60
    )
    assert (rows, reached) == (-2, False)
    assert (ways == 7.0).all()


def test_settling_stays_on_the_fibre_and_gains_room(over_a_cell):
    """From each configuration to one that is no worse, inside limits and cone."""
    robot, cells, task, problem, work, cell, found, _ = over_a_cell
    for a in found[:10]:
        q = a.copy()
        settle(problem, work, problem.points[cell], problem.approaches[cell], q, 40)
        assert not refusal(robot, cells, task, q[None], cell)
        assert (q >= robot.lower).all()
        assert (q <= robot.upper).all()


@pytest.mark.parametrize(
    ("stroke", "tool", "feasible"),
    [
        ((-3.9, -2.5), -3.0, True),
        ((-3.9, -2.5), 1.0, False),
        ((50.0, 60.0), 55.0, True),
        ((-np.inf, -2.5), -7.0, True),
        ((2.0, np.inf), 8.0, True),
        (FREE, 8.0, True),
    ],
)
def test_a_slide_whose_stroke_lies_far_out(stroke, tool, feasible):
    """Guesses stay inside the limits, wherever these are; what is out of reach is so by proof."""
    robot = robot_of([joint(1, "prismatic", axis=(1, 0, 0), limits=(-1, 1)), joint(2)])
    robot = robot.with_limits({"j1": stroke})
    cells = plane((tool - 0.1, tool + 0.1), (-1e-4, 1e-4), side="outside").cells(3, 1)
    guesses = Exploration(robot, cells, arrays_of(robot, cells, Task(0.0, 180)), 0).guesses(50)
    assert (guesses >= robot.lower).all()
    assert (guesses <= robot.upper).all()
    verdict = check(robot, cells, Task(0.0, 180))
    assert verdict.feasible is feasible
    assert verdict.evidence == ("witness" if feasible else "proof")
