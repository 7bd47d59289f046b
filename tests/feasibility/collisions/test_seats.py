"""Objects of the scene on links, and a world that moves: the bodies are where they really are."""

import numpy as np
import pytest

from coverable_errors import ArgumentError
from feasibility.certification.collisions import collision_replay
from feasibility.collisions import Collision, Obstacle, ToolShape, gather
from feasibility.collisions.words import SURFACE, TOOL
from robots import Axis, load_robot
from surfaces import plane

TURN = (-180, 180)
TABLE = Axis("table", "revolute", limits_deg=TURN, carries="surface", position=(0.6, 0.1, 0.2))
SHELF = Obstacle.box("shelf", (0.4, 0.3, 0.02), position=(0.5, -0.2, 0.75), rpy_deg=(0, 10, 20))
FLOOR = Obstacle.halfspace("floor", position=(0, 0, -0.3))
PEG = Obstacle.cylinder("peg", 0.02, 0.2, position=(0.15, 0.1, 0.1), frame="table")
PLATE = ((-0.2, 0.2), (-0.15, 0.15))


def on_the_table(obstacle, angle):
    """The same object in the world, with the table at an angle (rad)."""
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    turn[:3, 3] = TABLE.position
    return Obstacle(obstacle.name, obstacle.geometry, turn @ obstacle.placement)


@pytest.mark.parametrize("angle", [0.7, -2.0])
def test_a_moving_world_is_as_near_as_one_at_rest(angle):
    """The judge, on the arm with its table, and on the arm alone beside the turned part."""
    free = load_robot("ur5", axes=[TABLE])
    alone = load_robot("ur5")
    seen = Collision(scene=(SHELF, FLOOR, PEG))
    still = Collision(scene=(SHELF, FLOOR, on_the_table(PEG, angle)))
    part = plane(*PLATE, position=(0, 0, 0.02))
    turned = plane(*PLATE, position=(0.6, 0.1, 0.22), rpy_deg=(0, 0, np.degrees(angle)))
    one, other = gather(free, part, seen, 0.1), gather(alone, turned, still, 0.1)
    assert [seat.obstacle.name for seat in one.carried] == ["shelf", "floor"]
    assert [thing.name for thing in one.scene] == ["peg"]
    rng = np.random.default_rng(3)
    hits = 0
    for q in rng.uniform(-1.6, 1.6, (12, 6)):
        here = collision_replay(free, one, np.array([[angle, *q]]))
        there = collision_replay(alone, other, q[None])
        assert here.accepted == there.accepted
        hits += not here.accepted
        if here.accepted:
            assert here.nearest_pair == there.nearest_pair
            assert abs(here.min_clearance - there.min_clearance) < 1e-5
    assert 0 < hits < 12


def test_pairs_of_what_the_world_and_the_table_carry():
    robot = load_robot("ur5", axes=[TABLE])
    bodies = gather(robot, plane(*PLATE), Collision(scene=(SHELF, PEG)), 0.1)
    asked = {frozenset((pair.first, pair.second)) for pair in bodies.pairs}
    assert {frozenset(("shelf", SURFACE)), frozenset(("shelf", "peg"))} <= asked
    assert frozenset(("peg", SURFACE)) not in asked
    assert frozenset(("base_link", SURFACE)) in asked  # the base turns round the table
    assert frozenset(("base_link", "shelf")) not in asked
    rigid = {(pair.first, pair.second) for pair in bodies.left_out if pair.why == "rigid"}
    assert ("base_link", "shelf") in rigid


def test_the_world_is_no_link_without_a_shape():
    rail = Axis("rail", "prismatic", limits=(0, 1))
    lift = Axis("lift", "prismatic", limits=(0, 1))
    robot = load_robot("ur5", axes=[rail, lift, TABLE])
    assert gather(robot, plane(*PLATE), Collision(), 0.1).unchecked == ("rail",)


def test_an_object_on_the_forearm_moves_with_it():
    ur5 = load_robot("ur5")
    guide = Obstacle.box("guide", (0.05, 0.05, 0.2), position=(0, 0.1, 0.2), frame="forearm_link")
    part = plane((0.4, 0.6), (-0.1, 0.1))
    bodies = gather(ur5, part, Collision(scene=(guide, FLOOR)), 0.1)
    solid = next(solid for solid in bodies.solids if solid.owner == "guide")
    assert solid.joint == 3
    asked = {(pair.first, pair.second) for pair in bodies.pairs}
    assert {("guide", SURFACE), ("wrist_1_link", "guide"), ("guide", "floor")} <= asked
    assert ("forearm_link", "guide") not in asked


def test_the_tool_of_an_arm_that_holds_the_part_is_what_stands_on_the_tool_frame():
    nozzle = ToolShape.cylinder(0.01, 0.05, position=(0, 0, -0.03))
    tcp = ((0.7, 0, 0.4), (0, 0, 0))
    robot = load_robot("ur5", tool_frame="world", tcp=tcp, surface_link="tool0")
    part = plane((-0.05, 0.05), (-0.05, 0.05))
    mounted = gather(robot, part, Collision(tool=(nozzle,), tool_clearance=0.001), 0.01)
    near = {pair.first: pair.clearance for pair in mounted.pairs if pair.second == SURFACE}
    assert near[TOOL] == 0.001
    assert near["base_link"] == 0.0
    named = gather(robot, part, Collision(tool_links=("base_link",), tool_clearance=0.002), 0.01)
    assert {p.first: p.clearance for p in named.pairs}["base_link"] == 0.002
    assert not [note for note in mounted.notes if "base_link reach" in note]


def test_a_frame_that_is_no_link():
    lost = Obstacle.sphere("ball", 0.1, frame="turntabel")
    robot = load_robot("ur5", axes=[TABLE])
    with pytest.raises(ArgumentError, match=r"scene\[0\].frame must be a link .* 'turntabel'"):
        gather(robot, plane(*PLATE), Collision(scene=(lost,)), 0.1)
    with pytest.raises(ArgumentError, match="frame must be the name of a link"):
        Obstacle.sphere("ball", 0.1, frame=3)
