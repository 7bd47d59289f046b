"""Objects of the scene and shapes of the tool: what they are, and what is refused."""

import numpy as np
import pytest
import trimesh

from coverable_errors import ArgumentError
from feasibility.collisions import Collision, HalfSpace, Obstacle, ToolShape, read_triangles
from robots.shapes import Triangles
from robots.urdf import Box, Cylinder
from surfaces import rotation_from_rpy


def faults_of(make):
    """The faults of a call, by key."""
    with pytest.raises(ArgumentError) as caught:
        make()
    return {fault.key: fault for fault in caught.value.faults}


def test_a_box_stands_where_it_is_put():
    shelf = Obstacle.box("shelf", (0.5, 0.6, 0.02), (0.55, 0.0, 0.5), (10, 20, 30), 0.01)
    assert shelf.geometry == Box((0.5, 0.6, 0.02))
    assert shelf.clearance == 0.01
    turn = rotation_from_rpy(*np.radians([10, 20, 30]))
    assert np.allclose(shelf.placement[:3, :3], turn)
    assert shelf.placement[:, 3].tolist() == [0.55, 0.0, 0.5, 1.0]
    assert not shelf.placement.flags.writeable


@pytest.mark.parametrize(
    ("made", "geometry"),
    [
        (Obstacle.cylinder("post", 0.05, 1), Cylinder(0.05, 1.0)),
        (Obstacle.halfspace("floor"), HalfSpace()),
        (ToolShape.cylinder(0.05, 1), Cylinder(0.05, 1.0)),
        (ToolShape.box([1, 2, 3]), Box((1.0, 2.0, 3.0))),
    ],
)
def test_numbers_are_kept_as_floats(made, geometry):
    assert made.geometry == geometry


BAD = [
    (lambda: Obstacle.box("a", (0.5, 0.0, 1.0)), {"size[1]"}),
    (lambda: Obstacle.box("a", (0.5, 1.0)), {"size"}),
    (lambda: Obstacle.box("a", (0.5, np.nan, 1.0)), {"size"}),
    (lambda: Obstacle.box("a", (0.5, np.inf, 1.0), (0, 0)), {"size", "position"}),
    (lambda: Obstacle.box("a", (0.5, -1e-3, 1e-9)), {"size[1]", "size[2]"}),
    (lambda: Obstacle.box("a", "box"), {"size"}),
    (lambda: Obstacle.sphere("a", 1e9), {"radius"}),
    (lambda: Obstacle.sphere("a", 1e200), {"radius"}),
    (lambda: Obstacle.sphere("a", None, (1e9, 0, 0)), {"radius", "position"}),
    (lambda: Obstacle.cylinder("a", -1.0, 0.0, clearance=-1.0), {"radius", "length", "clearance"}),
    (lambda: Obstacle.capsule("a", True, "long", rpy_deg=(0, 0, np.nan)),
     {"radius", "length", "rpy_deg"}),
    (lambda: Obstacle.halfspace("", clearance=np.nan), {"name", "clearance"}),
    (lambda: Obstacle.halfspace("surface"), {"name"}),
    (lambda: Obstacle.halfspace("a\nb"), {"name"}),
    (lambda: Obstacle.halfspace(7), {"name"}),
    (lambda: Obstacle("a", 5, np.eye(4)), {"geometry"}),
    (lambda: Obstacle("a", HalfSpace(), np.diag([1.0, 1.0, -1.0, 1.0])), {"placement"}),
    (lambda: Obstacle("a", HalfSpace(), np.diag([2.0, 2.0, 2.0, 1.0])), {"placement"}),
    (lambda: Obstacle("a", HalfSpace(), np.full((4, 4), np.nan)), {"placement"}),
    (lambda: Obstacle("a", HalfSpace(), "here"), {"placement"}),
    (lambda: ToolShape(HalfSpace(), np.eye(4)), {"geometry"}),
    (lambda: ToolShape.sphere(0.0, "far"), {"radius", "position"}),
    (lambda: Obstacle.mesh("a", "no such.stl", position=(0, 0)), {"file", "position"}),
    (lambda: ToolShape.mesh("no such.stl", scale=-1.0), {"scale"}),
]  # fmt: skip


@pytest.mark.parametrize(("make", "keys"), BAD)
def test_all_that_is_no_body_is_named_at_once(make, keys):
    assert set(faults_of(make)) == keys


FLAT = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
BAD_TRIANGLES = [
    (FLAT * np.nan, [[0, 1, 2]], "vertices"),
    (FLAT * 1e300, [[0, 1, 2]], "faces"),
    ((2.0 * FLAT - 1.0) * 1.7e308, [[0, 1, 2]], "faces"),
    (FLAT * 1e-12, [[0, 1, 2]], "faces"),
    (FLAT, [[0, 1, 3]], "faces"),
    (FLAT, [[0, 1, -1]], "faces"),
    (FLAT, [[0, 1, 1]], "faces"),
    (FLAT, np.zeros((0, 3), dtype=int), "faces"),
    (FLAT, [[0.0, 1.0, 2.0]], "faces"),
    (FLAT, [[0, 1]], "faces"),
    (FLAT, "faces", "faces"),
    (FLAT[:, :2], [[0, 1, 2]], "vertices"),
    ("points", [[0, 1, 2]], "vertices"),
    ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], "faces"),
    (FLAT, np.zeros((500_001, 3), dtype=int), "faces"),
]


@pytest.mark.parametrize(("vertices", "faces", "key"), BAD_TRIANGLES)
def test_triangles_that_bound_nothing_are_refused(vertices, faces, key):
    assert set(faults_of(lambda: Obstacle("a", Triangles(vertices, faces, True), np.eye(4)))) == {
        key
    }


def obstacle_of(mesh):
    """A trimesh as an object, its own word about being closed ignored."""
    return Obstacle("part", Triangles(mesh.vertices, mesh.faces, False), np.eye(4))


def test_closed_meshes_are_solids_and_look_outwards():
    solid = trimesh.creation.box((1, 2, 3))
    assert obstacle_of(solid).geometry.closed
    soup = solid.triangles.reshape(-1, 3)  # as an STL has them, nothing shared
    welded = Obstacle("part", Triangles(soup, np.arange(36).reshape(-1, 3), False), np.eye(4))
    assert welded.geometry.closed
    assert len(welded.geometry.vertices) == 8
    turned = solid.faces.copy()
    turned[0] = turned[0, ::-1]  # as in careless files
    solid.invert()
    for mesh in (solid, trimesh.Trimesh(solid.vertices, turned, process=False)):
        outwards = obstacle_of(mesh).geometry
        assert outwards.closed
        assert trimesh.Trimesh(outwards.vertices, outwards.faces).volume == pytest.approx(6.0)


def test_open_and_tangled_meshes_are_sheets_and_say_so():
    solid = trimesh.creation.box((1, 2, 3))
    tangled = np.concatenate([solid.faces, solid.faces[:1]])
    double = Triangles(FLAT, np.array([[0, 1, 2], [0, 2, 1]]), True)  # closed, but no inside
    for shape in (
        Triangles(solid.vertices, solid.faces[:-1], True),
        Triangles(solid.vertices, tangled, True),
        double,
    ):
        obstacle = Obstacle("part", shape, np.eye(4))
        assert not obstacle.geometry.closed
        assert "taken as a sheet" in obstacle.notes[0]
    assert obstacle_of(solid).notes == ()


def test_a_mesh_file_is_read_in_its_unit(tmp_path):
    file = tmp_path / "part.stl"
    trimesh.creation.box((400, 300, 200)).export(file)
    with pytest.raises(ArgumentError, match=r"'part.stl'.*400 m wide.*scale = 0.001"):
        Obstacle.mesh("part", file)
    part = Obstacle.mesh("part", file, scale=0.001)
    assert np.ptp(part.geometry.vertices, axis=0) == pytest.approx([0.4, 0.3, 0.2])
    assert part.geometry.closed
    tool = ToolShape.mesh(file, 0.001, rpy_deg=(0, 0, 90))
    assert (tool.geometry.vertices == part.geometry.vertices).all()


def test_a_mesh_of_five_million_faces_is_refused_by_its_header(tmp_path):
    file = tmp_path / "huge.stl"
    with file.open("wb") as stream:
        stream.write(bytes(80) + (5_000_000).to_bytes(4, "little"))
        stream.truncate(84 + 50 * 5_000_000)  # a sparse file
    with pytest.raises(ArgumentError, match="5,000,000 faces, more than"):
        read_triangles(file, 1.0)


def test_a_collision_names_everything_that_is_wrong():
    shelf = Obstacle.box("shelf", (1, 1, 1))
    faults = faults_of(
        lambda: Collision(
            self_=1, clearance=-1.0, tool_clearance=np.nan, thickness=11.0, shapes="hull",
            tool_links=("a", "a"), allow=(("a", "a"), "ab", ("b", "c")), srdf=7,
            clearances=(("c", "b", 0.1), ("a", "b", -1), ("x", "y")),
            scene=(shelf, shelf, 5), tool=(shelf,),
        )
    )  # fmt: skip
    assert set(faults) == {
        "self_", "clearance", "tool_clearance", "thickness", "shapes", "tool_links", "allow[0]",
        "allow[1]", "srdf", "clearances[0]", "clearances[1].value", "clearances[2]", "scene[2]",
        "scene", "tool[0]",
    }  # fmt: skip
    assert "hulls" in faults["shapes"].message
    assert "allow" in faults["clearances[0]"].message


@pytest.mark.parametrize("key", ["allow", "clearances", "scene", "tool", "tool_links"])
@pytest.mark.parametrize("value", [5, "ab", None, {"a": "b"}])
def test_a_list_that_is_none_is_refused(key, value):
    assert set(faults_of(lambda: Collision(**{key: value}))) == {key}


def test_names_are_judged_with_the_arm():
    links = ("base", "link1", "link2")
    collision = Collision(
        surface=False, tool_links=("link2", "nozle"), scene=(Obstacle.sphere("link1", 1.0),),
        allow=(("link1", "link3"), ("surface", "base")), clearances=(("tool", "shelf", 0.1),),
    )  # fmt: skip
    faults = {fault.key: fault.message for fault in collision.unknown_names(links)}
    assert set(faults) == {
        "scene[0].name", "tool_links[1]", "allow[0]", "allow[1]", "clearances[0].pair"
    }  # fmt: skip
    assert "surface = true" in faults["allow[1]"]
    assert 'did you mean "link2"?' in faults["allow[0]"]
    assert not Collision(allow=(("base", "surface"), ("tool", "link2"))).unknown_names(links)


def test_a_tool_clearance_beyond_the_standoff_is_said():
    (note,) = Collision(tool_clearance=0.012).notes_on(0.005)
    assert "nearer than 7 mm" in note
    assert not Collision(tool_clearance=0.005).notes_on(0.005)
    assert not Collision(surface=False, tool_clearance=0.012).notes_on(0.005)
