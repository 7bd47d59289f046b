"""The judge of collisions, on bodies of known distances: what it accepts and refuses."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from capsule_arms import at, bodies_of, box_mesh, capsule_links, fork, pair, planar_arm, wall_at
from mesh_patches import stacked

from coverable import Obstacle
from coverable.errors import ArgumentError
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.collisions.problem_bodies import Soup
from robots.shapes.bodies import Solid, Triangles
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

CLOSE = 2e-6  # m, what coal is trusted with
SLIDE, CRANK, ELBOW = planar_arm([0.1], ["prismatic"]), planar_arm([1.0]), planar_arm([0.5, 0.4])
LINKS = capsule_links([0.5, 0.4], 0.03)
SHEET = np.array([[0.5, y, z] for y in (-1, 1) for z in (-1, 1)], dtype=float)
SHEET = SHEET[[[0, 1, 2], [1, 3, 2]]]


def judged(robot, bodies, *rows, off=None):
    deviations = None if off is None else np.tile(np.array(off, float), (len(rows) - 1, 1))
    return collision_replay(robot, bodies, np.array(rows, dtype=float), deviations)


def sliding(shape, thing, clearance=0.0, place=None, **more):
    """A shape on a slide along x, and another at x = 1 m."""
    placed = Obstacle("thing", thing, at(1.0) if place is None else place)
    solid = Solid("link1", 1, np.eye(4), shape)
    return bodies_of([solid], [placed], [pair("link1", "thing", clearance)], **more)


def touches_from(judge, low, high):
    """The angle or length between low (accepted) and high (refused) where the judge changes."""
    assert judge(low).accepted
    assert not judge(high).accepted
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if judge(middle).accepted else (low, middle)
    return low


@pytest.mark.parametrize("clearance", [0.0, 0.03])
def test_an_arm_turns_towards_a_wall(clearance):
    """The end of link 2 is at 0.9 cos q; its capsule reaches the radius further."""
    bodies = bodies_of(LINKS, [wall_at(0.7)], [pair("link2", "wall", clearance)])
    turned = touches_from(lambda q: judged(ELBOW, bodies, [q, 0.0]), 1.5, 0.0)
    assert turned == pytest.approx(np.arccos((0.7 - 0.03 - clearance) / 0.9), abs=1e-6)
    swept = touches_from(lambda q: judged(ELBOW, bodies, [1.5, 0.0], [q, 0.0]), 1.4, 0.0)
    assert swept == pytest.approx(turned, abs=1e-6)


SHAPES = {  # each reaches 0.1 m along x
    "ball": Sphere(0.1), "box": Box((0.2, 0.3, 0.4)), "capsule": Capsule(0.1, 0.4),
    "cylinder": Cylinder(0.1, 0.4), "mesh": box_mesh((0.2, 0.3, 0.4)),
}  # fmt: skip


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("other", SHAPES)
def test_distances_along_x(name, other):
    bodies = sliding(SHAPES[name], SHAPES[other])
    for x in (0.0, 0.75):
        found = judged(SLIDE, bodies, [x])
        assert 0.8 - x - 1e-6 <= found.min_clearance <= 0.8 - x
        assert found.nearest_pair == ("link1", "thing")
    moved = judged(SLIDE, bodies, [-0.5], [0.75], [0.1])
    assert 0.9 * 0.05 - 1e-6 <= moved.min_clearance <= 0.05 <= moved.measured_clearance + 1e-6
    through = judged(SLIDE, bodies, [0.0], [2.0])
    assert not through.accepted
    assert through.min_clearance <= 1e-9
    assert "link1 and thing overlap by" in through.refusal or "touch" in through.refusal


@pytest.mark.parametrize("name", SHAPES)
def test_distances_from_a_half_space_and_a_sheet(name):
    solid = Solid("link1", 1, np.eye(4), SHAPES[name])
    bodies = bodies_of([solid], [wall_at(0.5)], [pair("link1", "wall")])
    assert judged(SLIDE, bodies, [0.0], [0.3]).min_clearance == pytest.approx(0.1, abs=CLOSE)
    soup = Soup("surface", SHEET, 0.004, False)
    bodies = bodies_of([solid], pairs=[pair("link1", "surface")], soups=[soup])
    assert judged(SLIDE, bodies, [0.0], [0.3]).min_clearance == pytest.approx(0.096, abs=CLOSE)
    assert not judged(SLIDE, bodies, [0.0], [1.0]).accepted  # through it to its other side
    assert judged(SLIDE, bodies, [0.8], [1.0]).min_clearance == pytest.approx(0.196, abs=CLOSE)


@pytest.mark.parametrize("gap", [0.003, 0.0139, 0.0141, 0.2])
@pytest.mark.parametrize(("names", "joint"), [
    (("tool", "surface"), 1), (("surface", "tool"), 1), (("tool", "surface"), 0),
])  # fmt: skip
def test_what_triangles_may_be_off_is_taken_off_their_distance(gap, names, joint):
    """A ball before a surface that is known to 4 mm; 10 mm are needed, whoever is named first."""
    triangle = np.array([[[0.1 + gap, -1, -1], [0.1 + gap, 1, -1], [0.1 + gap, 0, 1.0]]])
    ball = Solid("tool", joint, np.eye(4), Sphere(0.1))
    soup = Soup("surface", triangle, 0.004, False)
    bodies = bodies_of([ball], pairs=[pair(*names, 0.01)], soups=[soup])
    found = judged(CRANK, bodies, [0.0])
    assert found.accepted == (gap > 0.014)
    assert gap - 0.0041 <= found.min_clearance <= gap - 0.004 + 1e-6
    if found.accepted:
        assert found.measured_clearance == pytest.approx(gap + 0.004)


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("carried", [True, False])
def test_a_ball_wholly_inside_a_mesh(closed, carried):
    """A closed mesh is a solid: nothing may be inside. An open one is a sheet."""
    both = box_mesh((2.0, 2.0, 2.0), closed), Sphere(0.1)
    shape, thing = both if carried else both[::-1]
    found = judged(SLIDE, sliding(shape, thing, place=np.eye(4)), [0.0], [0.2])
    assert found.accepted is not closed
    if closed:
        assert found.faults[0].row == 0
        assert "one is inside the other" in found.refusal
    else:
        assert 0.0 < found.min_clearance <= 0.7


def test_a_mesh_within_a_mesh_and_a_room_with_walls():
    """A room is solid in its walls alone: its inner shell is turned inwards."""
    inner, outer = box_mesh((1.0, 1.0, 1.0)), box_mesh((1.2, 1.2, 1.2))
    shells = (outer.vertices, outer.faces), (inner.vertices, inner.faces[:, ::-1])
    room = Triangles(*stacked(*shells), True)
    for thing, far, accepted in ((outer, 0.3, False), (room, 0.3, True), (room, 0.45, False)):
        bodies = sliding(box_mesh((0.2, 0.2, 0.2)), thing, place=np.eye(4))
        assert judged(SLIDE, bodies, [-0.2], [far]).accepted is accepted


@pytest.mark.parametrize("thing", [Cylinder(0.1, 1.0), box_mesh((0.2, 0.2, 1.0)), Sphere(0.1)])
@pytest.mark.parametrize(("off", "left"), [(None, 0.2), (0.05, 0.15)])
def test_a_hollow_link_is_not_its_hull(thing, off, left):
    """A post between the arms of the fork, that slides along x, or along y and off its line."""
    arm = SLIDE if off is None else planar_arm([0.1], ["prismatic"], [(0, 1, 0)])
    rows = ([-0.3], [0.3]) if off is None else ([0.0], [1e-3], [0.0])
    for spare, accepted in ((0.01, True), (-0.01, False)):
        bodies = sliding(fork(), thing, left - spare, np.eye(4))
        found = judged(arm, bodies, *rows, off=None if off is None else [off])
        assert found.accepted is accepted
        assert found.min_clearance <= left + CLOSE or not accepted


@pytest.mark.parametrize("thickness", [0.1, 1e-6])
@pytest.mark.parametrize("kind", ["box", "mesh", "sheet"])
def test_a_thin_wall_between_two_rows(kind, thickness):
    """Both rows are clear of it by 0.3 m: only the middle of the way is not."""
    size, scene, soups = (1.0, thickness, 1.0), [], []
    if kind == "sheet":
        corners = np.array([[x, 0, z] for x in (0.3, 1.3) for z in (-0.5, 0.5)], dtype=float)
        soups = [Soup("wall", corners[[[0, 1, 2], [1, 3, 2]]], 0.0, False)]
    else:
        scene = [Obstacle("wall", Box(size) if kind == "box" else box_mesh(size), at(0.8))]
    bodies = bodies_of(LINKS, scene, [pair("link2", "wall")], soups)
    for side in (0.6, -0.6):
        assert judged(ELBOW, bodies, [side, 0.0]).accepted
    found = judged(ELBOW, bodies, [0.6, 0.0], [-0.6, 0.0])
    (fault,) = found.faults
    assert not found.accepted
    assert fault.row == 0
    assert 0.2 < fault.share < 0.8
    assert "row 1 to 2" in found.refusal
    assert "link2 and wall" in found.refusal


@pytest.mark.parametrize("thing", [Box((0.1, 2.0, 2.0)), box_mesh((0.1, 2.0, 2.0))])
def test_rows_that_deviate_need_more_room(thing):
    """A joint 0.02 rad off the line moves the arm's end 0.9 * 0.02 m: 18 mm and the radius."""
    wall = [Obstacle("wall", thing, at(1.05))]
    bodies = bodies_of(LINKS, wall, [pair("link2", "wall", 0.05)])
    rows = [0.3, 0.0], [-0.3, 0.0]
    straight = judged(ELBOW, bodies, *rows)
    assert straight.accepted
    assert 0.9 * 0.07 <= straight.min_clearance <= 0.07
    bent = judged(ELBOW, bodies, *rows, off=[0.02, 0.0])
    assert bent.accepted
    assert bent.min_clearance <= 0.07 - 0.9 * 0.3 * 0.02  # a sine of 0.3 at the rows
    for off in ([0.03, 0.0], [-0.03, 0.0], [0.0, 0.06]):
        refused = judged(ELBOW, bodies, *rows, off=off)
        assert not refused.accepted
        assert 0.06 < refused.faults[0].distance < 0.08  # measured on the straight line


@pytest.mark.parametrize("needed", [0.5, 0.6, 0.699999, 0.8])
def test_what_balls_part_has_to_be_as_far_as_is_needed(needed):
    """A second pair is nearer, and needs nothing: what is known of the first one is not enough."""
    scene = [Obstacle("far", Sphere(0.1), at(y=0.9)), Obstacle("near", Sphere(0.1), at(z=0.21))]
    solid = Solid("link1", 1, np.eye(4), Sphere(0.1))
    pairs = [pair("link1", "far", needed), pair("link1", "near")]
    found = judged(SLIDE, bodies_of([solid], scene, pairs), [0.0], [1e-4])
    assert found.accepted == (needed < 0.7)
    assert found.min_clearance == pytest.approx(0.01, abs=1e-6)


@pytest.mark.parametrize("needed", [0.59, 0.61])
def test_balls_that_may_be_off_are_that_much_nearer(needed):
    """0.7 m apart, and the slide up to 0.1 m off its line."""
    bodies = sliding(Sphere(0.1), Sphere(0.1), needed, at(0.9))
    assert judged(SLIDE, bodies, [0.0], [1e-4], off=[0.1]).accepted == (needed < 0.6)


@pytest.mark.parametrize("shape", [Sphere(0.1), fork()], ids=["ball", "mesh"])
@pytest.mark.parametrize("less", [1e-3, 1e-6])
def test_what_cannot_be_decided_is_refused(shape, less):
    """It goes round a ball, equally far everywhere: planes follow, coal's yes or no needs steps."""
    solid = Solid("link1", 1, at(1.0), shape)
    near = 0.9 if isinstance(shape, Sphere) else np.hypot(0.5, 0.3)
    scene = [Obstacle("ball", Sphere(0.1), np.eye(4))]
    bodies = bodies_of([solid], scene, [pair("link1", "ball", near - 0.1 - less)])
    found = judged(CRANK, bodies, [0], [2])
    assert found.accepted == (isinstance(shape, Sphere) or less > 1e-5)
    if not found.accepted:
        assert "not certified" in found.refusal
        assert np.isnan(found.faults[0].distance)


def test_faults_name_pair_place_and_depth_the_nearest_first():
    scene = [wall_at(0.85), Obstacle("ball", Sphere(0.1), at(0.0, 1.0))]
    pairs = [pair("link2", "wall", 0.005), pair("link2", "ball", 0.01)]
    rows = [0.5, 0.0], [0.1, 0.0], [0.5, 0.0], [np.pi / 2, 0.0]
    found = judged(ELBOW, bodies_of(LINKS, scene, pairs), *rows)
    assert [fault.pair for fault in found.faults] == [("link2", "wall"), ("link2", "ball")]
    assert (found.nearest_pair, found.measured_clearance) == (("link2", "wall"), None)
    assert found.min_clearance == found.faults[0].distance < 0.0
    assert "link2 and wall overlap by" in found.refusal
    assert found.faults[1].distance == pytest.approx(-0.03, abs=0.03)
    (fault,) = judged(ELBOW, bodies_of(LINKS, scene, [pair("link2", "wall", 0.05)]), rows[0]).faults
    gap = 0.85 - 0.9 * np.cos(0.5) - 0.03
    assert fault.distance == pytest.approx(gap, abs=1e-6)
    assert fault.text == f"link2 and wall are {1e3 * gap:.4g} mm apart, 50 mm are needed"


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_no_numbers_are_refused(value):
    bodies = bodies_of(LINKS, [wall_at(2.0)], [pair("link2", "wall")])
    found = judged(ELBOW, bodies, [0.0, 0.0], [value, 0.0], [0.0, 0.0])
    assert found.refusal == "row 2: a joint value is not finite"
    assert not judged(ELBOW, bodies, [0.0, 0.0], [0.0, 0.0], off=[value, 0.0]).accepted


def test_what_cannot_be_judged_is_an_error_with_words():
    good = bodies_of(LINKS, [wall_at(2.0)], [pair("link2", "wall")])
    with pytest.raises(ArgumentError, match=r"shape \(m, 2\)"):
        collision_replay(ELBOW, good, np.zeros((3, 3)))
    for count in (1, 3):  # one row would be that of every segment
        with pytest.raises(ArgumentError, match="deviations"):
            collision_replay(ELBOW, good, np.zeros((3, 2)), np.zeros((count, 2)))
    assert judged(ELBOW, bodies_of(LINKS), [0.0, 0.0], [0.0, 0.0]).min_clearance is None
    with pytest.raises(ArgumentError, match="shelf"):
        judged(ELBOW, replace(good, pairs=(pair("link2", "shelf"),)), [0.0, 0.0])
    gone = Triangles(np.zeros((3, 3)), np.array([[0, 1, 7]]), False)
    nowhere = Triangles(np.full((3, 3), np.nan), np.array([[0, 1, 2]]), False)
    nothing = Triangles(np.zeros((0, 3)), np.zeros((0, 3)), False)
    for shape in (nowhere, gone, nothing, Sphere(np.nan)):
        bad = replace(good, solids=(Solid("link2", 2, np.eye(4), shape),))
        with suppress(ValueError, IndexError):  # shapes are checked where they are made
            assert not judged(ELBOW, bad, [0.0, 0.0], [0.0, 0.0]).accepted
