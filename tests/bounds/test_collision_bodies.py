"""Who is asked to stay clear of whom; objects and tools, where they stand, and what holds them."""

import numpy as np
import pytest
import trimesh
from foreign_clearances import distance_from_hull
from referee import unit
from samples import sampled, spread

from coverable import Axis, Collision, Obstacle, ToolShape, load_robot, plane
from coverable.errors import ArgumentError
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.problem_bodies import Soup, at_rest, scene_solids, tool_solids
from feasibility.collisions.words import TOOL
from robots.shapes.bodies import HalfSpace, Triangles
from robots.shapes.links import outer_bodies
from surfaces.surface import rotation_from_rpy

UR5 = load_robot("ur5")
PLATE = plane((0.4, 0.6), (-0.1, 0.1), position=(0.0, 0.0, 0.3), side="outside")
SHELF = Obstacle.box("shelf", (0.4, 0.4, 0.02), (0.5, 0.0, 0.8), clearance=0.02)
POST = Obstacle.cylinder("post", 0.05, 1.0, (0.0, 0.6, 0.5))
TABLE = Axis(
    "table", "revolute", limits_deg=(-180, 180), carries="surface", position=(0.6, 0.1, 0.2)
)
PEG = Obstacle.cylinder("peg", 0.02, 0.2, position=(0.15, 0.1, 0.1), frame="table")


def bodies_of(robot=UR5, standoff=0.02, surface=PLATE, **asked):
    return gather(robot, surface, Collision(**asked), standoff)


def clearances(bodies):
    asked = {frozenset((pair.first, pair.second)): pair.clearance for pair in bodies.pairs}
    assert len(asked) == len(bodies.pairs), "a pair is asked for twice"
    return asked


def left_out(bodies, why=None):
    return {frozenset((x.first, x.second)) for x in bodies.left_out if why in (None, x.why)}


def both(*names):
    return {frozenset(pair) for pair in names}


def test_every_pair_is_asked_for_or_left_out_with_a_reason():
    bodies = bodies_of(scene=(SHELF, POST))
    owners = sorted({solid.owner for solid in bodies.solids})
    own = both(*((a, b) for a in owners for b in owners if a < b))
    others = both(*((a, b) for a in owners for b in ("shelf", "post", "surface")))
    asked = set(clearances(bodies))
    assert asked | left_out(bodies) == own | others
    assert not asked & left_out(bodies)
    # What stands still is not asked for with the scene: no motion changes that.
    still = {solid.owner for solid in bodies.solids if solid.joint == 0}
    assert still
    assert both(*((one, other) for one in still for other in ("shelf", "surface"))) <= left_out(
        bodies, "rigid")  # fmt: skip
    assert gather(UR5, PLATE, None, 0.02) is None
    assert gather(UR5, PLATE, Collision(self_=False, surface=False), 0.02) is None


def test_each_pair_has_its_own_clearance():
    own = ("forearm_link", "post", 0.03), ("forearm_link", "upper_arm_link", 0.0)
    scene, least = (SHELF, POST), {"clearance": 0.005, "tool_clearance": 0.001}
    bodies = bodies_of(scene=scene, **least, clearances=own)
    asked = clearances(bodies)
    assert asked[frozenset(("forearm_link", "post"))] == 0.03
    assert asked[frozenset(("wrist_1_link", "post"))] == 0.005
    assert asked[frozenset(("forearm_link", "shelf"))] == 0.02  # the object's own
    assert asked[frozenset(("wrist_1_link", "surface"))] == 0.005
    tool = {solid.owner for solid in bodies.solids if solid.joint == 6}
    assert {asked[frozenset((owner, "surface"))] for owner in tool} == {0.001}
    named = clearances(bodies_of(clearance=0.005, tool_links=("wrist_2_link",)))
    assert named[frozenset(("wrist_2_link", "surface"))] == 0.0
    assert named[frozenset(("wrist_3_link", "surface"))] == 0.005


def test_a_tool_of_the_case_is_asked_for_and_one_that_touches_is_left_out():
    nozzle = ToolShape.cylinder(0.02, 0.1, (0.0, 0.0, -0.06))
    bodies = bodies_of(clearance=0.005, tool=(nozzle,), scene=(POST,))
    asked = clearances(bodies)
    for other, needed in (("surface", 0.0), ("post", 0.005), ("forearm_link", 0.005)):
        assert asked[frozenset((TOOL, other))] == needed
    assert frozenset((TOOL, "wrist_3_link")) in left_out(bodies, "rigid")
    touching = bodies_of(standoff=0.0)
    last = {solid.owner for solid in touching.solids if solid.joint == 6}
    assert left_out(touching, "contact") == both(*((owner, "surface") for owner in last))
    assert frozenset(("forearm_link", "surface")) in clearances(touching)


def test_what_is_allowed_is_left_out_and_names_that_are_nothing_are_refused_at_once():
    allow = ("surface", "forearm_link"), ("forearm_link", "shoulder_link"), ("post", "wrist_1_link")
    assert left_out(bodies_of(scene=(POST,), allow=allow), "allowed") == both(*allow)
    wrong = {
        "allow": (("link9", "surface"),), "clearances": (("forearm_link", "shelve", 0.1),),
        "tool_links": ("hand",), "scene": (SHELF,),
    }  # fmt: skip
    with pytest.raises(ArgumentError) as caught:
        bodies_of(**wrong)
    text = str(caught.value)
    assert all(name in text for name in ("link9", "shelve", "hand", "collision.allow[0]"))


def test_pairs_of_what_the_world_a_table_and_a_forearm_carry():
    part = plane((-0.2, 0.2), (-0.15, 0.15))
    bodies = bodies_of(load_robot("ur5", axes=[TABLE]), 0.1, part, scene=(SHELF, PEG))
    asked = set(clearances(bodies))
    wanted = ("shelf", "surface"), ("shelf", "peg"), ("base_link", "surface")
    assert both(*wanted) <= asked  # the base turns round the table
    assert not both(("peg", "surface"), ("base_link", "shelf")) & asked
    assert frozenset(("base_link", "shelf")) in left_out(bodies, "rigid")
    guide = Obstacle.box("guide", (0.05, 0.05, 0.2), position=(0, 0.1, 0.2), frame="forearm_link")
    bodies = bodies_of(scene=(guide, SHELF))
    (solid,) = (solid for solid in bodies.solids if solid.owner == "guide")
    assert solid.joint == 3
    asked = set(clearances(bodies))
    assert both(("guide", "surface"), ("wrist_1_link", "guide"), ("guide", "shelf")) <= asked
    assert not both(("forearm_link", "guide")) & asked
    rails = [Axis(name, "prismatic", limits=(0, 1)) for name in ("rail", "lift")]
    assert bodies_of(load_robot("ur5", axes=[*rails, TABLE])).unchecked == ("rail",)


def test_the_tool_of_an_arm_that_holds_the_part_is_what_stands_on_the_tool_frame():
    nozzle = ToolShape.cylinder(0.01, 0.05, position=(0, 0, -0.03))
    tcp = ((0.7, 0, 0.4), (0, 0, 0))
    robot = load_robot("ur5", tool_frame="world", tcp=tcp, surface_link="tool0")
    part = plane((-0.05, 0.05), (-0.05, 0.05))
    mounted = bodies_of(robot, 0.01, part, tool=(nozzle,), tool_clearance=0.001)
    near = clearances(mounted)
    assert near[frozenset((TOOL, "surface"))] == 0.001
    assert near[frozenset(("base_link", "surface"))] == 0.0
    named = bodies_of(robot, 0.01, part, tool_links=("base_link",), tool_clearance=0.002)
    assert clearances(named)[frozenset(("base_link", "surface"))] == 0.002
    assert not [note for note in mounted.notes if "base_link reach" in note]
    lost = Obstacle.sphere("ball", 0.1, frame="turntabel")
    with pytest.raises(ArgumentError, match=r"scene\[0\].frame must be a link .* 'turntabel'"):
        bodies_of(load_robot("ur5", axes=[TABLE]), 0.1, part, scene=(lost,))


@pytest.mark.parametrize("height", [-5.0, 0.0, 0.3])
def test_a_half_space_is_as_far_as_its_box_from_all_that_the_arm_reaches(height):
    floor = Obstacle.halfspace("floor", (4.0, -7.0, height), (30.0, -10.0, 20.0))
    (box,), rng = seen(floor, 1.3), np.random.default_rng(2)
    points = unit(rng.normal(size=(60, 3))) * 1.3 * rng.uniform(0.2, 1.0, (60, 1))
    for point in points:
        above = max(0.0, floor.placement[:3, 2] @ (point - floor.placement[:3, 3]))
        off = distance_from_hull(point, box.vertices) - box.radius
        assert off == pytest.approx(above, abs=1e-6)


def seen(obstacle, reach=1.0):
    return at_rest(*scene_solids([obstacle], UR5), reach)


def part_of(mesh, closed=False):
    """A trimesh as the search sees it, its own word about being closed ignored."""
    return seen(Obstacle("part", Triangles(mesh.vertices, mesh.faces, closed), np.eye(4)))


def test_convex_meshes_are_one_body_and_others_are_triangles():
    for convex in (trimesh.creation.box((1, 2, 3)), trimesh.creation.icosphere(1, 0.3)):
        (body,) = part_of(convex)
        assert len(body.vertices) == len(convex.vertices)
    bent = trimesh.creation.box((1, 2, 3)).subdivide()
    bent.vertices[8] *= 0.9
    cube, hollow = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((1, 1, 1))
    hollow.invert()
    for other in (
        bent,
        trimesh.util.concatenate([cube, cube.copy().apply_translation((3, 0, 0))]),
        trimesh.util.concatenate([trimesh.creation.box((3, 3, 3)), hollow]),
        trimesh.creation.torus(0.5, 0.1, 8, 6),
        trimesh.creation.icosphere(3, 0.3),  # convex, but of many vertices
    ):
        soup = part_of(other)
        assert isinstance(soup, Soup)
        assert (soup.closed, soup.deviation) == (True, 0.0)
        found = np.sort(soup.triangles.reshape(-1))
        assert found == pytest.approx(np.sort(other.triangles.reshape(-1)))
    assert not part_of(trimesh.Trimesh(bent.vertices, bent.faces[1:])).closed


def test_tool_shapes_move_with_the_last_joint():
    """For the judge and for the search: the ends of a capsule, 0.1 m apart."""
    shape = ToolShape.capsule(0.02, 0.1, position=(0.0, 0.01, -0.05), rpy_deg=(90, 0, 0))
    (solid,) = tool_solids((shape,), UR5)
    (body,) = outer_bodies(solid)
    assert (solid.owner, body.owner, solid.joint, body.joint) == ("tool", "tool", 6, 6)
    flange = UR5.model.frames[UR5.tool_frame_id].placement.homogeneous
    assert np.allclose(solid.placement, flange @ shape.placement)
    ends = (np.array([[0.0, 0.06, -0.05, 1.0], [0.0, -0.04, -0.05, 1.0]]) @ flange.T)[:, :3]
    assert np.allclose(body.vertices, ends) or np.allclose(body.vertices, ends[::-1])
    assert body.radius == 0.02


def keys_of(make):
    with pytest.raises(ArgumentError) as caught:
        make()
    return {fault.key for fault in caught.value.faults}


@pytest.mark.parametrize(("make", "keys"), [
    (lambda: Obstacle.box("a", (0.5, np.inf, 1.0), (0, 0)), {"size", "position"}),
    (lambda: Obstacle.capsule("a", True, "long", rpy_deg=(0, 0, np.nan)),
     {"radius", "length", "rpy_deg"}),
    (lambda: Obstacle.halfspace("", clearance=np.nan), {"name", "clearance"}),
    (lambda: Obstacle.sphere("surface", 1e200, frame=3), {"name", "radius", "frame"}),
    (lambda: Obstacle("a\nb", 5, np.eye(4)), {"name", "geometry"}),
    *((lambda place=place: Obstacle("a", HalfSpace(), place), {"placement"})
      for place in (np.diag([1.0, 1.0, -1.0, 1.0]), np.diag([2.0, 2, 2, 1]), np.eye(4) * np.nan)),
    (lambda: ToolShape(HalfSpace(), np.eye(4)), {"geometry"}),
    (lambda: Obstacle.mesh("a", "no such.stl", position=(0, 0)), {"file", "position"}),
    (lambda: Collision(
        self_=1, clearance=-1.0, tool_clearance=np.nan, thickness=11.0, shapes="hull",
        tool_links=("a", "a"), allow=(("a", "a"), "ab", ("b", "c")), srdf=7,
        clearances=(("c", "b", 0.1), ("a", "b", -1), ("x", "y")),
        scene=(SHELF, SHELF, 5), tool=(SHELF,)),
     {"self_", "clearance", "tool_clearance", "thickness", "shapes", "tool_links", "allow[0]",
      "allow[1]", "srdf", "clearances[0]", "clearances[1].value", "clearances[2]", "scene[2]",
      "scene", "tool[0]"}),
    *((lambda key=key: Collision(**{key: 5}), {key})
      for key in ("allow", "clearances", "scene", "tool", "tool_links")),
])  # fmt: skip
def test_all_that_is_wrong_is_named_at_once(make, keys):
    assert keys_of(make) == keys


def test_corners_are_welded_and_what_is_no_solid_is_a_sheet_that_says_so():
    solid = trimesh.creation.box((1, 2, 3))
    corners = solid.triangles.reshape(-1, 3)  # as an STL has them, nothing shared
    welded = Obstacle("a", Triangles(corners, np.arange(36).reshape(-1, 3), False), np.eye(4))
    assert (welded.geometry.closed, len(welded.geometry.vertices), welded.notes) == (True, 8, ())
    sheet = Obstacle("part", Triangles(solid.vertices, solid.faces[:-1], True), np.eye(4))
    assert not sheet.geometry.closed
    assert "taken as a sheet" in sheet.notes[0]


@sampled("angle", spread([-2.0, 0.7], 1))
def test_a_moving_world_is_as_near_as_one_at_rest(angle):
    """The judge, on the arm with its table, and on the arm alone beside the turned part."""
    shelf = Obstacle.box("shelf", (0.4, 0.3, 0.02), (0.5, -0.2, 0.75), (0, 10, 20))
    floor = Obstacle.halfspace("floor", position=(0, 0, -0.3))
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = rotation_from_rpy(0, 0, angle), TABLE.position
    peg = Obstacle("peg", PEG.geometry, turn @ PEG.placement)
    free, ends = load_robot("ur5", axes=[TABLE]), ((-0.2, 0.2), (-0.15, 0.15))
    part = plane(*ends, position=(0, 0, 0.02))
    turned = plane(*ends, position=(0.6, 0.1, 0.22), rpy_deg=(0, 0, np.degrees(angle)))
    one = bodies_of(free, 0.1, part, scene=(shelf, floor, PEG))
    other = bodies_of(UR5, 0.1, turned, scene=(shelf, floor, peg))
    assert [(thing.owner, thing.joint) for thing in one.scene] == [
        ("shelf", 1), ("floor", 1), ("peg", 0)]  # fmt: skip
    hits = 0
    for q in np.random.default_rng(3).uniform(-1.6, 1.6, (12, 6)):
        here = collision_replay(free, one, np.array([[angle, *q]]))
        there = collision_replay(UR5, other, q[None])
        assert here.accepted == there.accepted
        hits += not here.accepted
        if here.accepted:
            assert here.nearest_pair == there.nearest_pair
            assert abs(here.min_clearance - there.min_clearance) < 1e-5
    assert 0 < hits < 12
