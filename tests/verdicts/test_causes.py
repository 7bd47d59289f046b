"""Causes: each missed cell has one, and its figures are those of the geometry, known by hand."""

import math
import re
from dataclasses import replace

import numpy as np
import plain
import puma_oracle
import pytest
from arm_urdfs import joint
from asked import question, verdict_of
from random_arms import robot_of

import coverable
from coverable import CauseKind, Search, Task, ToolShape, check, load_robot, plane, sphere
from feasibility.roadmap.causes import diagnosis
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.motions.working_memory import work_for

PUMA = load_robot("puma560", limits="set-1")
UR5 = load_robot("ur5")
REACH = math.hypot(0.7 + math.hypot(0.1, 0.7), 0.1)
"""m, from the first joint's origin to the wrist centre."""


def kinds(verdict):
    return {cause.kind for cause in verdict.causes}


def number(pattern, text):
    found = re.search(pattern, text)
    assert found is not None, text
    return float(found[1])


@pytest.mark.parametrize("beyond", [0.05, 0.4, 2.0])
def test_out_of_reach_says_by_how_much(beyond):
    dome = sphere(REACH + beyond, (60, 110), (-30, 60))
    verdict = check(PUMA, dome.cells(2, 3), Task(0.0, 90))
    assert kinds(verdict) == {CauseKind.OUT_OF_REACH}
    for cause in verdict.causes:
        assert cause.proved
        short = number(r"([0-9.]+) mm short", cause.detail)
        assert abs(short - 1e3 * beyond) <= 0.05 * 1e3 * beyond + 1.0


def test_of_several_descents_the_nearest_counts():
    """Two links of 1 m, the target 3 m away: a stretched arm that points away from it stays."""
    links = [joint(1, limits=(-4, 4)), joint(2, xyz=(1, 0, 0)), joint(3, "fixed", (1, 0, 0))]
    robot, task = robot_of(links), Task(0.0, 90)
    cells = plane((-0.1, 0.1), (-0.1, 0.1), position=(-3, 0, 0)).cells(1, 1)
    guesses = np.array([[3.0, 0.1], [0.0, 0.0]])
    arrays = arrays_of(robot, cells, task)
    for some, away in ((guesses[1:], 5.0), (guesses[::-1], 1.0), (guesses, 1.0)):
        found = diagnosis.nearest_point(arrays, work_for(2), 0, np.ascontiguousarray(some))
        assert found == pytest.approx(away, abs=1e-3)


@pytest.mark.parametrize("name", ["folds over a bend", "paper 4d"])
def test_a_joint_limit_says_which_joint_and_where_it_would_have_to_be(name):
    """A tube about the first axis: joint1 follows the azimuth, less what the forearm is beside."""
    verdict = verdict_of(name)
    assert kinds(verdict) == {CauseKind.JOINT_LIMITS}
    radius = verdict.cells.surface.radius - verdict.task.standoff
    offset = math.degrees(math.asin(0.1 / radius))
    azimuth = np.degrees(verdict.cells.u)
    low, high = np.degrees([verdict.robot.lower[0], verdict.robot.upper[0]])
    if name != "paper 4d":  # there it may reach backwards
        within = (azimuth - offset >= low) & (azimuth - offset <= high)
        np.testing.assert_array_equal(verdict.covered, within)
    else:
        assert [cause.cell for cause in verdict.causes] == list(range(60, 90))
    for cause in verdict.causes:
        assert cause.proved
        needed = number(r"joint1 would need (-?[0-9.]+) deg", cause.detail)
        stop = number(r"it stops at (-?[0-9.]+) deg", cause.detail)
        there = azimuth[cause.cell]
        ways = (there - offset, there - 180.0 + offset)
        assert min(abs(needed - way) for way in ways) < 0.3
        assert stop == pytest.approx(low if abs(needed - low) < abs(needed - high) else high)


def test_orientation_says_the_smallest_angle_that_could_be_had():
    """joint4 and joint5 held: the tool stands along the forearm, and only joints 1 to 3 aim it."""
    arm = PUMA.with_limits({"joint4": (0.0, 0.0), "joint5": (0.0, 0.0), "joint6": (0.0, 0.0)})
    wall = plane((-0.2, 0.2), (-0.2, 0.2), "outside", (0.6, 0.1, 0.2), (0.0, 90.0, 0.0))
    verdict = check(arm, wall.cells(3, 3), Task(0.0, 20))
    assert kinds(verdict) == {CauseKind.ORIENTATION}
    points, approaches, _ = verdict.task.targets(verdict.cells)
    least = np.degrees(puma_oracle.tilts(points, approaches).min(axis=1))
    for cause in verdict.causes:
        reported, best = number(r"tilts ([0-9.]+) deg", cause.detail), least[cause.cell]
        assert best - 0.1 <= reported <= best + 1.5  # found by bisection, from random starts
        assert reported > 20.0


def test_roll_says_which_could_be_had():
    """The wrist of a UR5 held at 20 to 60 degrees, the arm on one side, from above."""
    asked = question("a square and 15 degrees")
    held = {"wrist_3_joint": np.radians([20.0, 60.0]), "shoulder_pan_joint": (-1.0, 1.0)}
    held |= {"shoulder_lift_joint": (-2.5, -0.5), "elbow_joint": (0.5, 2.5)}
    robot, task = asked.robot.with_limits(held), replace(asked.task, cone_deg=2.0)
    cells = asked.cells.surface.cells(3, 3)
    verdict = check(robot, cells, task)
    assert kinds(verdict) == {CauseKind.ORIENTATION}
    detail = verdict.causes[0].detail
    assert "-15 to 15 deg are allowed" in detail
    low = number(r"possible from (-?[0-9.]+)", detail)
    high = number(r"possible from \S+ to (-?[0-9.]+)", detail)
    mine = replace(task, roll_deg=(low - 0.5, high + 0.5))
    assert check(robot, cells, mine).covered[verdict.causes[0].cell]


# In the way: of the tool only a ball around its point is asked for.

BALL = 0.05
ALONE = coverable.Collision(self_=False, surface=False, tool=(ToolShape.sphere(BALL),))


def asked_beside(obstacle, clearance):
    """One cell at x = 0.5, z = 0.3, and a ball as the only tool."""
    links = [name for name in UR5.link_names if name != "tool"]
    allow = tuple((name, obstacle.name) for name in links)
    asked = replace(ALONE, clearance=clearance, scene=(obstacle,), allow=allow)
    cells = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3)).cells(1, 1)
    return check(UR5, cells, Task(0.02, 30, 0.001, collision=asked))


@pytest.mark.parametrize("gap", [-0.02, 0.03])
def test_what_is_in_the_way_is_named_with_its_distance(gap):
    at = 0.5 + BALL + gap
    wall = coverable.Obstacle.halfspace("wall", position=(at, 0.0, 0.0), rpy_deg=(0.0, -90.0, 0.0))
    (cause,) = asked_beside(wall, 0.05).causes
    assert cause.kind is CauseKind.COLLISION
    assert cause.pair == ("tool", "wall")
    assert cause.clearance == pytest.approx(gap, abs=0.0012)
    assert asked_beside(wall, 0.0).feasible == (gap > 0.0)


@pytest.mark.parametrize(("clearance", "end"), [(0.0, "collide"), (0.005, "come nearer than 5 mm")])
def test_what_stops_a_motion_on_its_way_is_named(clearance, end):
    """A wall between two cells."""
    cells = plane((0.4, 0.6), (-0.2, 0.2), "outside", (0.0, 0.0, 0.3)).cells(1, 2)
    wall = coverable.Obstacle.box("wall", (0.5, 0.01, 0.3), position=(0.5, 0.0, 0.3))
    asked = coverable.Collision(clearance=clearance, scene=(wall,))
    problem = UR5, cells, Task(0.02, 30)
    searches = [Search(seed=seed, evaluations=3000) for seed in range(5)]
    causes = [check(*problem, one, collision=asked).causes[0] for one in searches]
    named = [cause for cause in causes if cause.pair is not None]
    assert named
    for cause in named:
        assert (cause.kind, cause.pair[1]) == (CauseKind.DISCONNECTED, "wall")
        assert cause.detail.endswith(f"{' and '.join(cause.pair)} would {end}")


def test_all_that_is_under_a_roof_names_it():
    """Unless it may be touched."""
    verdict = verdict_of("under a roof")
    assert kinds(verdict) == {CauseKind.COLLISION}
    assert all("roof" in cause.pair and cause.clearance < 0.0 for cause in verdict.causes)
    asked = verdict.task.collision
    touched = tuple((link, "roof") for link in UR5.link_names if link not in ("world", "tool0"))
    with_bodies = {pair for one in verdict.causes for pair in one.pair} - {"roof"}
    allow = tuple(pair for pair in touched if pair[0] in with_bodies | set(UR5.link_names))
    free = replace(verdict.task, collision=replace(asked, allow=allow))
    assert check(verdict.robot, verdict.cells, free).feasible


def test_of_many_pairs_the_one_in_the_way_is_named_with_its_distance():
    """An arm that has hardly any room to move: the referee measures it in the middle."""
    verdict = verdict_of("too near itself")
    scene = plain.scene_of(verdict.robot, verdict.cells, verdict.task)
    pairs = [pair[:2] for pair in scene.pairs]
    middle = 0.5 * (verdict.robot.lower + verdict.robot.upper)
    for cause in verdict.causes:
        assert abs(cause.clearance - scene.distances(middle, [pairs.index(cause.pair)])[0]) < 0.02
        assert cause.clearance < 0.05


@pytest.mark.parametrize("name", ["puma560 262", "puma560 268"])
def test_of_several_motions_over_a_missed_cell_the_largest_is_named(name):
    verdict = verdict_of(name)
    several = 0
    for cause in verdict.causes:
        holding = [len(c) for c in verdict.components if cause.cell in c.tolist()]
        several += len(set(holding)) > 1
        if cause.kind is CauseKind.DISCONNECTED:
            assert number(r"covers (\d+) of", cause.detail) == max(holding)
    assert several


def test_what_a_cut_parts_is_proved_and_named():
    """All postures of a component are on one side of the cuts, those of others on another."""
    verdict = next(v for v in map(verdict_of, CUT) if v.proof is not None)
    apart = [c for c in verdict.causes if c.kind is CauseKind.DISCONNECTED]
    assert len(apart) == len(verdict.causes) > 0
    for cause in apart:
        assert cause.proved
        assert "nowhere" in cause.detail
        assert re.search(r"the best motion is (below|above)", cause.detail)
    tree = verdict.proof
    postures, cells = tree.folded(verdict.postures), [c.tolist() for c in verdict.components]
    best = postures[cells.index(np.flatnonzero(verdict.covered).tolist())]
    for cause in apart:
        other = next(postures[k] for k in range(len(cells)) if cause.cell in cells[k])
        cut = tree.path_to(best, other)[1]
        assert cause.detail.endswith("above" if best[cut.joint] > cut.value else "below")


CUT = ("puma560 184", "puma560 188", "puma560 197", "a large square and a stop of the wrist")


def test_a_search_that_was_stopped_reports_no_false_cause():
    """Every cell of this plate can be covered: no cause may name a constraint."""
    asked = question("plate")
    stopped = check(asked.robot, asked.cells, asked.task, Search(time_limit=1e-9))
    assert len(stopped.causes) == int((~stopped.covered).sum()) > 0
    assert kinds(stopped) == {CauseKind.DISCONNECTED}
    assert not any(cause.proved for cause in stopped.causes)


def test_causes_are_made_once_and_are_plain_numbers():
    for name in ("long plate", "paper 4f", "waist of poses", "panda out of reach"):
        verdict = verdict_of(name)
        assert verdict.causes is verdict.causes
        assert not re.search(r"\b(nan|inf)\b", " ".join(cause.detail for cause in verdict.causes))
