"""What the search stores holds: targets and their curves, configurations, motions, the walk."""

import numpy as np
import pytest
from arm_urdfs import FREE, joint
from plain import tools
from random_arms import QUESTIONS, planar_arm, robot_of
from search_kernels import assert_walked

from coverable import Search, Task, check, load_case, plane, replay
from feasibility.roadmap.connecting import explore_self_motions
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.motions.tracking import track
from feasibility.roadmap.rounds import explore
from feasibility.roadmap.walk import covering_walk
from feasibility.verdict import Walk


@pytest.mark.parametrize("short", [0.3, 0.99, 1.01])
def test_a_target_beyond_reach_is_covered_within_the_tolerance_and_no_further(short):
    """A planar arm of three links, and one small cell a share of the tolerance beyond its reach."""
    robot = planar_arm(3)
    (reach,), _ = tools(robot, np.zeros((1, 3)))
    x, size = reach[0] + short * 0.01, 0.02
    patch = plane((x - size, x + size), (reach[1] - size, reach[1] + size), side="outside")
    cells = patch.cells(1, 1)
    for seed in range(3 if short < 1.0 else 1):
        verdict = check(robot, cells, Task(0.0, 180.0, 0.01), Search(seed=seed))
        assert verdict.evidence == ("witness" if short < 1.0 else "proof")
        if short < 1.0:
            (point,), _ = tools(robot, verdict.witness.q[:1])
            assert 0.999 * short * 0.01 <= np.linalg.norm(point - cells.centres[0]) <= 0.01


@pytest.mark.parametrize(("stroke", "tool", "feasible"), [
    ((-3.9, -2.5), -3.0, True), ((-3.9, -2.5), 1.0, False), ((50.0, 60.0), 55.0, True),
    ((-np.inf, -2.5), -7.0, True), (FREE, 8.0, True)])  # fmt: skip
def test_a_slide_whose_stroke_lies_far_out(stroke, tool, feasible):
    """Guesses stay inside the limits, wherever these are; what is out of reach is proved so."""
    sliding = joint(1, "prismatic", axis=(1, 0, 0), limits=(-1, 1))
    robot = robot_of([sliding, joint(2)]).with_limits({"j1": stroke})
    cells = plane((tool - 0.1, tool + 0.1), (-1e-4, 1e-4), side="outside").cells(3, 1)
    guesses = Exploration(robot, cells, arrays_of(robot, cells, Task(0.0, 180)), 0).guesses(50)
    assert ((guesses >= robot.lower) & (guesses <= robot.upper)).all()
    verdict = check(robot, cells, Task(0.0, 180))
    assert (verdict.feasible, verdict.evidence) == (feasible, "witness" if feasible else "proof")


def refusal(robot, cells, task, q, first, last):
    """Why the replay refuses a motion from one cell's centre to another's; empty if it does not."""
    marks = np.array([first, *[-1] * (len(q) - 2), last])
    return replay(robot, cells, task, Walk(q, marks), np.zeros(len(cells), dtype=bool)).refusal


@pytest.mark.parametrize("name", QUESTIONS)
def test_every_motion_that_a_search_stores_holds_and_the_walk_takes_them_alone(name):
    """Spread, explored and closed: edges run from node to node, and the judge accepts them."""
    robot, cells, task = QUESTIONS[name]
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), 0)
    explore(exploration)
    for cell in range(0, len(cells), 3):
        exploration.add_seeds(cell, exploration.guesses(3))
        explore_self_motions(exploration, cell)
    exploration.close_pairs(exploration.pairs, exploration.best)
    roadmap = exploration.roadmap
    assert len(roadmap.edges) >= len(cells) - 1
    for edge, (x, y, _) in enumerate(roadmap.edges):
        motion = roadmap.motion(edge)
        assert (motion[-1] == roadmap.q[y]).all()
        assert refusal(robot, cells, task, motion, roadmap.cell[x], roadmap.cell[y]) == ""
    order = assert_walked(roadmap, covering_walk(roadmap, exploration.best))
    assert set(order) == set(range(len(cells)))
    assert len(order) <= 1.4 * len(cells)


def test_a_motion_that_does_not_get_to_its_goal_ends_on_the_curve():
    robot, cells, task, _ = load_case("paper/4d").build()
    one = Exploration(robot, cells, arrays_of(robot, cells, task), 0)
    one.add_seeds(0, one.guesses(40))
    over, root = one.roadmap.over, one.roadmap.root_of
    x, y = next((x, y) for x in over[0] for y in over[1] if root(x) != root(y))
    asked = one.arrays, one.work, one.curve(0, 1), (0.0, 1.0), one.roadmap.q[x]
    assert np.array_equal(track(*asked, one.roadmap.q[y], False, 1)[0], track(*asked)[0])
