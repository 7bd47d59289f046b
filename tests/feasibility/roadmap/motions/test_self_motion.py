"""Self-motions over one cell: certified everywhere, and ending exactly at their goals."""

from __future__ import annotations

import numpy as np
import pytest
from arm_urdfs import FREE, joint
from dense_replay import tools
from random_arms import QUESTIONS, finite_limits, question, robot_of

from feasibility import Task, check
from feasibility.certification import replay
from feasibility.roadmap import Exploration, arrays_of, connect, look_at, margin_shares, work_for
from feasibility.roadmap.motions.arrays import OVERFLOW
from feasibility.roadmap.motions.self_motion import settle
from feasibility.verdict import Walk
from surfaces import plane


@pytest.fixture(params=QUESTIONS)
def over_a_cell(request):
    """Robot, cells, task, arrays, work, a cell, configurations over it, and their margins."""
    robot, cells, task = question(request.param)
    arrays, work = arrays_of(robot, cells, task), work_for(robot.n)
    rng = np.random.default_rng(4)
    cell = len(cells) // 2
    guesses = rng.uniform(*finite_limits(robot), (60, robot.n))
    margins = margin_shares(arrays, work, cell, guesses)
    return robot, cells, task, arrays, work, cell, guesses[margins >= 0.0], margins[margins >= 0.0]


def refusal(robot, cells, task, q, cell):
    """Why the replay refuses a motion whose ends are over a cell; empty if it does not."""
    marks = np.full(len(q), -1)
    marks[[0, -1]] = cell
    return replay(robot, cells, task, Walk(q, marks), np.zeros(len(cells), dtype=bool)).refusal


def test_the_margin_is_what_the_tightest_constraint_leaves(over_a_cell):
    """Configurations obey all constraints, and have the margins that are stated."""
    robot, cells, task, _, _, cell, found, margins = over_a_cell
    assert len(found) > 8
    target = task.targets(cells)
    points, axes = tools(robot, found)
    assert (np.linalg.norm(points - target.points[cell], axis=1) <= 0.02 * 1e-3 + 1e-12).all()
    chord = np.linalg.norm(axes - target.approaches[cell], axis=1)
    half = 0.5 * (robot.upper - robot.lower)
    free = np.minimum(found - robot.lower, robot.upper - found) / half
    expected = np.minimum(1.0 - chord / (2.0 * np.sin(task.cone / 2.0)), free.min(axis=1))
    np.testing.assert_allclose(margins, expected, atol=1e-9)
    assert (expected >= -1e-12).all()


def test_connect_ends_exactly_at_its_goal(over_a_cell):
    """Between all pairs of ten configurations, and to waypoints of the same motion."""
    robot, cells, task, arrays, work, cell, found, _ = over_a_cell
    waypoints = np.empty((200, robot.n))
    joined, halves, repeated = 0, 0, 0
    for a in found[:10]:
        for b in found[:10]:
            q = a.copy()
            look_at(arrays, work, cell)
            rows, reached = connect(arrays, work, q, b, waypoints, 3, 60)
            assert rows >= 0
            motion = np.vstack([a[None], waypoints[3 : 3 + rows]])
            assert (q == motion[-1]).all()
            assert reached == (rows > 0 and bool((motion[-1] == b).all()))
            assert not refusal(robot, cells, task, motion, cell)
            joined += reached
            if rows < 3 or reached:
                continue
            # Half of a motion that was made can be made again.
            goal = motion[len(motion) // 2]
            q = a.copy()
            rows, reached = connect(arrays, work, q, goal, waypoints, 0, 60)
            assert not refusal(robot, cells, task, np.vstack([a[None], waypoints[:rows]]), cell)
            assert not reached or (waypoints[rows - 1] == goal).all()
            halves += 1
            repeated += reached
    assert joined >= 10
    assert repeated >= 0.8 * halves


def test_connect_reports_that_the_waypoints_are_full(over_a_cell):
    """Nothing is written beyond the end."""
    robot, _, _, arrays, work, cell, found, _ = over_a_cell
    waypoints = np.full((5, robot.n), 7.0)
    q = found[0].copy()
    look_at(arrays, work, cell)
    rows, reached = connect(arrays, work, q, q.copy(), waypoints, 5, 60)
    assert (rows, reached) == (OVERFLOW, False)
    assert (waypoints == 7.0).all()


def test_settling_obeys_every_constraint(over_a_cell):
    """From each configuration to one inside limits and cone, over the same target."""
    robot, cells, task, arrays, work, cell, found, _ = over_a_cell
    for a in found[:10]:
        q = a.copy()
        settle(arrays, work, cell, q, 40)
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
    """Guesses stay inside the limits, wherever these are; what is out of reach is proved so."""
    robot = robot_of([joint(1, "prismatic", axis=(1, 0, 0), limits=(-1, 1)), joint(2)])
    robot = robot.with_limits({"j1": stroke})
    cells = plane((tool - 0.1, tool + 0.1), (-1e-4, 1e-4), side="outside").cells(3, 1)
    guesses = Exploration(robot, cells, arrays_of(robot, cells, Task(0.0, 180)), 0).guesses(50)
    assert (guesses >= robot.lower).all()
    assert (guesses <= robot.upper).all()
    verdict = check(robot, cells, Task(0.0, 180))
    assert verdict.feasible is feasible
    assert verdict.evidence == ("witness" if feasible else "proof")
