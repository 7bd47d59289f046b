"""The bodies of links: where they are, what stands in for what, what is refused, what they hold."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from approved import refused
from arm_urdfs import random_q
from plain import arm_of
from samples import sampled, seeds
from scipy.spatial import ConvexHull

from coverable import Obstacle, RobotError, ToolShape, as_yourdfpy, list_robots, load_robot
from robots.kinematics import Kinematics
from robots.shapes.bodies import Triangles
from robots.shapes.link_pairs import link_pairs
from robots.shapes.links import link_shapes
from robots.shapes.solids import checked_triangles, solid_faces
from robots.urdf.checked_urdf import check_urdf
from robots.urdf.link_shapes import Cylinder

LINKS = (
    '<robot name="three"><link name="base">{base}</link><link name="arm" {mark}>{arm}</link>'
    '<link name="hand">{hand}</link><link name="tip"/>'
    '<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>'
    '<origin xyz="0 0 1"/><axis xyz="0 0 1"/>'
    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    '<joint name="bend" type="revolute"><parent link="arm"/><child link="hand"/>'
    '<origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>'
    '<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>'
    '<joint name="end" type="fixed"><parent link="hand"/><child link="tip"/>'
    '<origin xyz="0.5 0 0"/></joint></robot>'
)
BOX = '<{0}><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.1 0.1"/></geometry></{0}>'
MESH = '<{0}><geometry><mesh filename="{1}"/></geometry></{0}>'
COLLISION, VISUAL = BOX.format("collision"), BOX.format("visual")


def three(folder, base=COLLISION, arm=COLLISION, hand=COLLISION, mark=""):
    (folder / "three.urdf").write_text(LINKS.format(base=base, arm=arm, hand=hand, mark=mark))
    return load_robot(str(folder / "three.urdf"))


def owners(shapes):
    return [solid.owner for solid in shapes.solids]


def assert_held(shapes):
    """Every point of every solid is in one of the polytopes of its link."""
    for solid in shapes.solids:
        if isinstance(solid.geometry, Triangles):
            some = np.random.default_rng(0).permutation(len(solid.geometry.vertices))[:400]
            points = np.asarray(solid.geometry.vertices[some])
        elif isinstance(solid.geometry, Cylinder):
            angle, half = np.linspace(0, 2 * np.pi, 100), solid.geometry.length / 2
            rim = solid.geometry.radius * np.column_stack([np.cos(angle), np.sin(angle)])
            ends = [np.column_stack([rim, np.full(100, z)]) for z in (-half, half)]
            points = np.concatenate(ends)
        else:  # exact hulls: their own tests
            continue
        points = points @ solid.placement[:3, :3].T + solid.placement[:3, 3]
        out = np.full(len(points), np.inf)
        for body in shapes.polytopes:
            if (body.owner, body.joint) == (solid.owner, solid.joint) and len(body.vertices) > 3:
                planes = ConvexHull(body.vertices).equations
                # Never more than the distance from the body.
                beyond = (points @ planes[:, :3].T + planes[:, 3]).max(axis=1) - body.radius
                out = np.minimum(out, beyond)
        assert out.max() <= 1e-9, f"{solid.owner}: {out.max()} m outside"


FEW = ["puma560", "ur5", "panda", "talos_arm"]
NAMES = [*FEW, *(info.name for info in list_robots() if info.name not in FEW)]


@sampled("name", [NAMES[k] for k in seeds(3, all=len(NAMES))])
def test_bodies_are_where_the_urdf_has_them_and_hulls_and_pieces_hold_them(name):
    """Placements by joints of the URDF, locked ones and fixed links included, without Pinocchio."""
    robot = load_robot(name)
    shapes, pieces = link_shapes(robot), link_shapes(robot, "pieces")
    checked = check_urdf(robot.urdf, robot.package_dirs)
    sources = {
        link: [s.origin for s in (*checked.collisions.shapes, *checked.visuals) if s.link == link]
        for link in checked.links
    }
    q = random_q(robot, np.random.default_rng(0))
    frames = arm_of(robot).frames(q)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, Kinematics(robot).configuration(q))
    seen = Counter()
    for solid in shapes.solids:
        here = data.oMi[solid.joint].homogeneous @ solid.placement
        origin = sources[solid.owner][seen[solid.owner]]
        seen[solid.owner] += 1
        there = frames[solid.owner][0] @ origin
        np.testing.assert_allclose(here, there, rtol=0, atol=1e-9)
    assert [solid.geometry for solid in pieces.solids] == [s.geometry for s in shapes.solids]
    assert len(pieces.polytopes) >= len(shapes.polytopes)
    for each in (shapes, pieces):
        assert_held(each)
        assert max(len(body.vertices) for body in each.polytopes) <= 64
        assert len({body.joint for body in each.polytopes}) > robot.n // 2
    assert link_pairs(robot, shapes).checked


def test_a_file_that_has_changed_is_read_again(tmp_path):
    robot = three(tmp_path, base=MESH.format("collision", "a.stl"))
    for size in (1.0, 2.5):
        trimesh.creation.box((size, 0.37, 0.41)).export(tmp_path / "a.stl")
        first, again = (link_shapes(robot).solids[0].geometry for _ in range(2))
        assert np.ptp(first.vertices[:, 0]) == size
        assert first is again


def test_a_mesh_is_scaled_mirrored_and_closed(tmp_path):
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "box.stl")
    mesh = MESH.format("collision", 'box.stl" scale="1 -0.1 0.2')
    body = link_shapes(three(tmp_path, base=mesh)).solids[0].geometry
    assert (body.closed, len(body.vertices), len(body.faces)) == (True, 8, 12)
    assert np.allclose(np.ptp(body.vertices, axis=0), [1, 0.2, 0.6])
    tool = ToolShape.mesh(tmp_path / "box.stl", 0.1)
    assert np.allclose(np.ptp(tool.geometry.vertices, axis=0), [0.1, 0.2, 0.3])


@pytest.mark.parametrize(("shape", "half"), [
    ('box size="1 2 3"', (0.5, 1, 1.5)), ('sphere radius="2"', (2, 2, 2)),
    ('cylinder radius="1" length="2"', (1, 1, 1)), ('capsule radius="1" length="2"', (1, 1, 2)),
])  # fmt: skip
def test_shapes_that_are_no_meshes_come_to_yourdfpy(shape, half, tmp_path):
    robot = three(tmp_path, base=VISUAL.replace('box size="0.1 0.1 0.1"', shape))
    ends = np.array([0, 0, 0.1]) + np.outer([-1, 1], half)
    np.testing.assert_allclose(as_yourdfpy(robot).scene.bounds, ends, atol=0.02)
    assert "has no URDF" in refused(as_yourdfpy, replace(robot, urdf=None))


# Shapes of base, arm and hand: which of them have a body, and which cannot be checked.
BROKEN, LOST = MESH.format("collision", "broken.stl"), MESH.format("collision", "lost.stl")
STAND_INS = {
    "as they are": ({}, "base arm hand", ()),
    "visuals": ({"base": VISUAL, "arm": BROKEN + VISUAL}, "base arm hand", ()),
    "both broken": ({"arm": BROKEN + MESH.format("visual", "w.stl")}, "base hand", ("arm",)),
    "no file": ({"arm": LOST}, "base hand", ("arm",)),
    "outside": ({"arm": MESH.format("collision", "../o.stl")}, "base hand", ("arm",)),
    "absolute": ({"arm": MESH.format("collision", "/etc/passwd")}, "base hand", ("arm",)),
    "a step file": ({"arm": MESH.format("collision", "a.step")}, "base hand", ("arm",)),
    "one of two": ({"arm": LOST + COLLISION}, "base arm hand", ("arm",)),
    "on purpose": ({"arm": VISUAL, "mark": 'collision="none"'}, "base hand", ("arm",)),
    "no such mark": ({"arm": VISUAL, "mark": 'collision="no"'}, "base arm hand", ()),
    "a mark and a shape": ({"mark": 'collision="none"'}, "base arm hand", ()),
    "no base": ({"base": ""}, "arm hand", ()),
    "a gap": ({"arm": ""}, "base hand", ("arm",)),
}


def test_what_stands_in_and_what_is_not_checked(tmp_path, approved):
    (tmp_path / "broken.stl").write_bytes(b"solid nothing")
    lines = []
    for name, (parts, bodies, unchecked) in STAND_INS.items():
        robot = three(tmp_path, **parts)
        shapes = link_shapes(robot)
        assert (owners(shapes), shapes.unchecked) == (bodies.split(), unchecked), name
        lines += [f"{name}: {note}" for note in (*robot.notes, *shapes.notes)]
    nothing = {"base": "", "arm": "", "hand": ""}
    robot = three(tmp_path)
    wrong = {"nothing": three(tmp_path, **nothing), "no path": replace(robot, urdf=None)}
    for name, one in wrong.items():
        with pytest.raises(RobotError) as caught:
            link_shapes(one)
        lines.append(f"{name}: {caught.value}")
    robot = three(tmp_path, **nothing | {"base": LOST})
    with pytest.raises(RobotError, match=r"no link has a shape .*lost\.stl"):
        link_shapes(robot)
    (tmp_path / "three.urdf").unlink()
    with pytest.raises(RobotError, match="there is no such file"):
        link_shapes(robot)
    approved("stand_ins", "\n".join(lines))


NAN, INF = float("nan"), float("inf")
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])
NONE = np.empty((0, 3), int)
REFUSED = {
    "no vertices": (np.empty((0, 3)), FACES), "no faces": (CORNERS, NONE),
    "nothing": (np.empty((0, 3)), NONE), "nan": (CORNERS + np.array([NAN, 0, 0]), FACES),
    "one nan": (np.vstack([CORNERS, [0, NAN, 0]]), FACES),
    "infinite": (np.full((4, 3), INF), FACES), "minus infinite": (CORNERS - [0, 0, INF], FACES),
    "huge": (CORNERS * 1e5, FACES), "largest": (CORNERS * 1.7e308, FACES),
    "far away": (CORNERS + 1e9, FACES), "negative index": (CORNERS, FACES - 1),
    "large index": (CORNERS, FACES + 1), "largest index": (CORNERS, FACES + (2**62)),
    "one point": (np.ones((3, 3)), FACES[:1]), "one corner": (CORNERS, np.zeros((5, 3), int)),
    "an edge": (CORNERS, np.array([[0, 1, 1], [1, 0, 0]])),
    "a line": (np.outer([0, 1, 2], np.ones(3)), FACES[:1]), "in a plane": (CORNERS[:, :2], FACES),
    "quads": (CORNERS, np.array([[0, 1, 2, 3]])), "all at once": (np.full((4, 3), NAN), NONE),
}  # fmt: skip


def test_triangles_that_are_no_body_are_refused(approved):
    lines = []
    for name, (vertices, faces) in REFUSED.items():
        with np.errstate(all="ignore"), pytest.raises(RobotError) as caught:
            checked_triangles(vertices, faces, "hand.stl")
        lines.append(f"{name}: " + " / ".join(str(caught.value).splitlines()))
        if name != "far away":  # from its own frame, which an object may be
            thing = refused(Obstacle, "a", Triangles(vertices, faces, False), np.eye(4))
            lines[-1] += f"; {thing}"
    approved("bad_triangles", "\n".join(lines))
    assert "k x 3" in refused(Obstacle, "a", Triangles("corners", FACES, False), np.eye(4))


CUBE = trimesh.creation.box((1.0, 2.0, 3.0))
TURNED = np.concatenate([CUBE.faces[:1, ::-1], CUBE.faces[1:]])
SPIKES = np.vstack([CORNERS, -CORNERS[2:]])
ONE_SIDE = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5), (0, 5, 1), (1, 2, 4), (2, 3, 5), (3, 4, 1),
            (4, 5, 2), (5, 1, 3)]  # fmt: skip
SOLIDS = {
    "a box": (CUBE.vertices, CUBE.faces, 6.0),
    "a box inside out": (CUBE.vertices, CUBE.faces[:, ::-1], 6.0),
    "mirrored": (CUBE.vertices * [-1.0, 1.0, 1.0], CUBE.faces, 6.0),
    "a face is missing": (CUBE.vertices, CUBE.faces[1:], None),
    "a face twice": (CUBE.vertices, np.concatenate([CUBE.faces, CUBE.faces[:1]]), None),
    "a face turned over": (CUBE.vertices, TURNED, 6.0),
    "two at an edge": (SPIKES, np.vstack([FACES, np.array([0, 1, 4, 5])[FACES]]), None),
    "a projective plane": (SPIKES, np.array(ONE_SIDE), None),
    "two faces back to back": (CUBE.vertices, np.array([[0, 1, 2], [0, 2, 1]]), None),
    "flat": (CUBE.vertices * [1.0, 1.0, 1e-10], CUBE.faces, None),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_links_and_objects_agree_on_what_is_a_solid(name):
    vertices, faces, volume = SOLIDS[name]
    assert (solid_faces(np.asarray(vertices), faces) is None) == (volume is None)
    link = checked_triangles(vertices, faces)
    thing = Obstacle("a", Triangles(vertices, faces, False), np.eye(4)).geometry
    assert link.closed == thing.closed == (volume is not None)
    for one in (link, thing) if volume is not None else ():
        body = trimesh.Trimesh(one.vertices, one.faces, process=False)
        assert body.is_winding_consistent
        assert body.volume == pytest.approx(volume)


def test_tangled_bodies_look_outwards():
    faces = np.concatenate([CUBE.faces, 8 + CUBE.faces])
    turned = np.random.default_rng(0).random(24)[:, None] < 0.5
    both = np.concatenate([CUBE.vertices, CUBE.vertices + 5.0])
    body = checked_triangles(both, np.where(turned, faces[:, ::-1], faces))
    assert body.closed
    assert trimesh.Trimesh(body.vertices, body.faces).volume == pytest.approx(12.0)
