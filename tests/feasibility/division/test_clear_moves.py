"""Moves between patches that keep clear: found, certified, and judged by a library of their own."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest
from capsule_arms import at, capsule_links, pair, planar_arm

from coverable_errors import at_least
from feasibility import Task
from feasibility.certification import collision_replay
from feasibility.collisions import Bodies, Collision, Obstacle, collision_buffer, gather
from feasibility.division import Division, Reconfiguration, divide
from feasibility.division.between_patches import clear_moves
from feasibility.division.free_motion import FreeSpace, free_motion
from feasibility.reports.division import as_json, as_text
from feasibility.roadmap import arrays_of
from feasibility.viewer import view_division
from robots import Robot, load_robot
from robots.shapes import Polytope
from robots.urdf import Box
from surfaces import plane

LINKS = (0.5, 0.4)
RADIUS = 0.03
CUBE = np.array(list(product((-0.5, 0.5), repeat=3)))


def among(scene: tuple[Obstacle, ...], clearance: float = 0.01) -> tuple[Robot, Bodies]:
    """An arm of two capsules in a plane, and boxes that it must stay clear of."""
    arm = planar_arm(LINKS).with_limits(np.radians([[-170, 170], [-150, 150]]))
    solids = capsule_links(LINKS, RADIUS)
    ends = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    polytopes = [
        Polytope(f"link{k}", k, length * ends, RADIUS) for k, length in enumerate(LINKS, 1)
    ]
    for one in scene:
        corners = np.array(
            [[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
        )
        vertices = corners * one.geometry.size + one.placement[:3, 3]
        polytopes.append(Polytope(one.name, 0, vertices, 0.0))
    pairs = [pair(f"link{k}", one.name, clearance) for one in scene for k in (1, 2)]
    return arm, Bodies(solids, tuple(polytopes), (), scene, tuple(pairs))


def block(x: float, y: float, name: str = "block") -> Obstacle:
    """A box of 0.2 m in the plane of the arm."""
    return Obstacle(name, Box((0.2, 0.2, 0.2)), at(x, y))


def gaps(robot: Robot, rows: np.ndarray, boxes: list[tuple[float, float]]) -> float:
    """m, the least distance of the arm from squares of 0.2 m, by dense samples."""
    least = math.inf
    for a, b in pairwise(rows):
        steps = 2 + int(np.abs(b - a).max() / 0.005)
        for q in a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a):
            elbow = LINKS[0] * np.array([math.cos(q[0]), math.sin(q[0])])
            hand = elbow + LINKS[1] * np.array([math.cos(q[0] + q[1]), math.sin(q[0] + q[1])])
            share = np.linspace(0.0, 1.0, 60)[:, None]
            points = np.concatenate([share * elbow, elbow + share * (hand - elbow)])
            for centre in boxes:
                outside = np.maximum(np.abs(points - centre) - 0.1, 0.0)
                least = min(least, float(np.linalg.norm(outside, axis=1).min()) - RADIUS)
    return least


START, END = np.radians([-60.0, 0.0]), np.radians([60.0, 0.0])


def test_a_straight_move_that_is_clear_stays_straight() -> None:
    arm, bodies = among((block(-0.8, 0.0),))
    rows = free_motion(FreeSpace(arm, collision_buffer(bodies, arm)), START, END, 0)
    assert rows is not None
    np.testing.assert_array_equal(rows, [START, END])


@pytest.mark.parametrize("seed", range(6))
def test_a_block_in_the_way_is_gone_around(seed: int) -> None:
    """Stretched, the arm would sweep it; it has to fold. Dense samples keep the clearance."""
    arm, bodies = among((block(0.75, 0.0),))
    assert not collision_replay(arm, bodies, np.stack([START, END])).accepted
    rows = free_motion(FreeSpace(arm, collision_buffer(bodies, arm)), START, END, seed)
    assert rows is not None
    assert len(rows) > 2
    np.testing.assert_array_equal(rows[[0, -1]], [START, END])
    assert (rows >= arm.lower).all()
    assert (rows <= arm.upper).all()
    assert collision_replay(arm, bodies, rows).accepted
    assert gaps(arm, rows, [(0.75, 0.0)]) > 0.01 - 1e-3  # 60 points a link
    # Folding to 60 degrees or so and back is enough.
    assert np.abs(np.diff(rows, axis=0)).sum() < math.radians(120 + 2 * 150)


def test_no_way_is_found_where_the_first_link_cannot_pass() -> None:
    """A block at the first link, and its limits in the way of the other side: None, in the end."""
    arm, bodies = among((block(0.4, 0.0),))
    space = FreeSpace(arm, collision_buffer(bodies, arm), 2000)
    assert free_motion(space, START, END, 0) is None
    assert space.left <= 0
    move = Reconfiguration(arm.joint_names, arm.prismatic, START, END)
    assert move.refusal == ""
    judged = replace(move, replayed=collision_replay(arm, bodies, move.waypoints))
    assert judged.refusal.startswith(
        "no path around was found, and straight on link1 and block over"
    )


def test_a_start_that_collides_gets_nowhere() -> None:
    arm, bodies = among((block(0.75, 0.0),))
    space = FreeSpace(arm, collision_buffer(bodies, arm), 500)
    assert free_motion(space, np.zeros(2), END, 0) is None


# a whole division


BEHIND = plane(
    (-0.1, 0.1), (-0.2, 0.2), position=(-0.6, 0.0, 0.3), rpy_deg=(0, -90, 0), side="inside"
)
POST = Obstacle.box("post", (0.1, 0.1, 1.2), position=(0.45, 0.0, 0.6))


@cache
def behind() -> Division:
    """A plate behind an arm whose first joint ends there; a post in front, where it has to pass."""
    robot = load_robot("ur5").with_limits(
        {
            "shoulder_pan_joint": np.radians([-180, 180]),
            "shoulder_lift_joint": np.radians([-90, 0]),
            "elbow_joint": np.radians([0, 150]),
            "wrist_1_joint": np.radians([-120, 120]),  # not folded back onto the forearm
        }
    )
    asked = Collision(clearance=0.005, scene=(POST,))
    return divide(robot, BEHIND.cells(1, 5), Task(0.05, cone_deg=30, collision=asked))


def bodies_of(division: Division) -> Bodies:
    task = division.task
    found = gather(division.robot, division.cells.surface, task.collision, task.standoff)
    assert found is not None
    return found


def test_the_move_between_two_patches_goes_around_the_post() -> None:
    division = behind()
    one, other = division.patches
    (move,) = division.moves
    assert division.whole
    np.testing.assert_array_equal(move.waypoints[0], one.walk.q[-1])
    np.testing.assert_array_equal(move.waypoints[-1], other.walk.q[0])
    straight = np.stack([move.start, move.end])
    assert not collision_replay(division.robot, bodies_of(division), straight).accepted
    assert len(move.via) > 0
    again = collision_replay(division.robot, bodies_of(division), move.waypoints)
    assert again.accepted
    assert again == move.replayed
    assert again.min_clearance is not None
    assert not move.via.flags.writeable
    for patch in division.patches:
        assert patch.accepted
        assert patch.certificate.min_clearance is not None
        assert collision_replay(division.robot, bodies_of(division), patch.walk.q).accepted


def test_the_reports_follow_the_move() -> None:
    division = behind()
    (move,) = division.moves
    assert move.replayed is not None
    found = json.loads(json.dumps(as_json(division), allow_nan=False))
    (said,) = found["moves"]
    np.testing.assert_array_equal(said["waypoints"], move.waypoints)
    assert said["refusal"] is None
    assert said["min_clearance_m"] == move.replayed.min_clearance
    assert said["nearest_pair"] == list(move.replayed.nearest_pair or ())
    assert found["patches"][0]["certificate"]["min_clearance_m"] >= 0.0
    text = " ".join(as_text(division, "behind").split())
    assert f"through {len(move.via)} configuration" in text
    assert (
        f"bodies at least {at_least(1e3 * (move.replayed.min_clearance or 0), 3)} mm apart" in text
    )


def test_a_move_that_is_not_found_is_said() -> None:
    """A wall around the arm but for the plate behind: patches as before, the move refused."""
    division = behind()
    wall = Obstacle.box("wall", (0.02, 4.0, 4.0), position=(0.2, 0.0, 0.0))
    task = replace(division.task, collision=Collision(clearance=0.005, scene=(wall,)))
    robot, cells = division.robot, division.cells
    buffer = arrays_of(robot, cells, task).collisions
    (move,) = clear_moves(robot, cells, task, buffer, division.moves)
    assert len(move.via) == 0
    both = replace(division.moves[0], replayed=move.replayed)
    assert "wall overlap" in move.refusal
    plan = replace(division.fewest, moves=(move,))
    refused = replace(division, task=task, fewest=plan, connected=plan)
    found = json.loads(json.dumps(as_json(refused), allow_nan=False))
    assert found["moves"][0]["refusal"] == move.refusal
    assert "refused: no path around was found" in " ".join(as_text(refused, "x").split())
    view = view_division(replace(refused, fewest=replace(plan, moves=(both,))))
    assert "(not clear)" in view.legend.text
    assert view.motion is not None
    assert all((view.motion.walk == row).all(axis=1).any() for row in both.waypoints)


def test_moves_stay_as_they_are_where_nothing_is_checked() -> None:
    division = behind()
    task = replace(division.task, collision=None)
    moves = [Reconfiguration(("a",), np.zeros(1, dtype=bool), np.zeros(1), np.ones(1))]
    (same,) = clear_moves(division.robot, division.cells, task, np.zeros(0), moves)
    assert same is moves[0]
    assert same.refusal == ""
    np.testing.assert_array_equal(same.waypoints, [[0.0], [1.0]])
