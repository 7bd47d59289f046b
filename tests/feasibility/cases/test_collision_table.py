"""The table [collision]: read back as written, every fault with its key, meshes read late."""

import os

import numpy as np
import pytest
import tomli_w
import trimesh
from bad_cases import GOOD, write

from feasibility.cases import Case, CaseError, load_case
from feasibility.collisions import HalfSpace
from robots.urdf import Box, Capsule

PLANE = GOOD.replace('name = "puma560"\nlimits = "set-1"', 'name = "ur5"')
FULL = """
[collision]
self = true
surface = false
clearance = 0.005
tool_clearance = 0.001
tool_links = ["tool0"]
allow = [["wrist_1_link", "wrist_3_link"], ["forearm_link", "shelf"]]
clearances = [{ pair = ["tool", "shelf"], value = 0.02 }]
srdf = "arm.srdf"
shapes = "pieces"
thickness = 0.002

[[collision.scene]]
name = "shelf"
kind = "box"
size = [0.5, 0.6, 0.02]
position = [0.55, 0, 0.5]
rpy_deg = [0, 0, 90]
clearance = 0.01

[[collision.scene]]
name = "floor"
kind = "halfspace"

[[collision.scene]]
name = "fixture"
kind = "mesh"
file = "fixture.stl"
scale = 0.001

[[collision.tool]]
kind = "capsule"
radius = 0.02
length = 0.1
position = [0, 0, 0.05]
"""


@pytest.fixture
def folder(tmp_path):
    trimesh.creation.box((100, 200, 300)).export(tmp_path / "fixture.stl")
    (tmp_path / "arm.srdf").write_text('<robot name="ur5"/>')
    return tmp_path


def faults_of(make):
    """The faults of a call, by key."""
    with pytest.raises(CaseError) as caught:
        make()
    return {fault.key: fault for fault in caught.value.faults}


def test_everything_that_is_written_arrives(folder):
    case = load_case(write(folder, PLANE + FULL))
    part = case.collision
    assert part.srdf == str(folder / "arm.srdf")
    assert part.checked == ("self", "scene")
    setup = case.build()
    found = setup.task.collision
    assert found.checked == ("self", "scene")
    numbers = found.clearance, found.tool_clearance, found.thickness, found.shapes
    assert numbers == (0.005, 0.001, 0.002, "pieces")
    assert found.allow == (("wrist_1_link", "wrist_3_link"), ("forearm_link", "shelf"))
    assert found.clearances == (("tool", "shelf", 0.02),)
    assert found.tool_links == ("tool0",)
    shelf, floor, fixture = found.scene
    assert (shelf.name, shelf.geometry, shelf.clearance) == ("shelf", Box((0.5, 0.6, 0.02)), 0.01)
    assert np.allclose(shelf.placement[:3, 0], [0, 1, 0])
    assert floor.geometry == HalfSpace()
    assert np.ptp(fixture.geometry.vertices, axis=0) == pytest.approx([0.1, 0.2, 0.3])
    (tool,) = found.tool
    assert tool.geometry == Capsule(0.02, 0.1)
    assert tool.placement[2, 3] == 0.05
    assert case.task.collision is None
    assert setup.task.standoff == case.task.standoff


def test_a_case_is_read_back_as_it_was(folder, monkeypatch):
    case = load_case(write(folder, PLANE + FULL))
    monkeypatch.chdir(os.sep)  # paths are absolute
    again = Case.from_toml(case.to_toml())
    assert again == case
    assert again.collision == case.collision
    assert again.with_overrides([]) == case
    plain = Case.from_toml(PLANE)
    assert plain != case
    assert plain.collision is None
    assert "collision" not in plain.to_tables()
    assert plain.build().task == plain.task
    bare = Case.from_toml(PLANE + "\n[collision]\n")
    assert bare.collision.checked == ("self", "surface")
    assert Case.from_toml(bare.to_toml()) == bare != plain


def test_settings_replace_and_add_keys(folder):
    case = load_case(write(folder, PLANE + FULL), ["collision.clearance=0.01", "collision.scene="])
    assert (case.collision.clearance, case.collision.scene) == (0.01, ())
    box = '{ name = "a", kind = "box", size = [1, 1, 1] }'
    added = Case.from_toml(PLANE).with_overrides([f"collision.scene=[{box}]"])
    assert added.collision.scene[0].kind == "box"
    assert added.collision.surface
    wrong = faults_of(lambda: case.with_overrides(["collision.clearance=-1"]))
    assert set(wrong) == {"collision.clearance"}


def scene(*objects, tool=(), **keys):
    """A case with these objects."""
    table = {"collision": {**keys, "scene": list(objects), "tool": list(tool)}}
    return PLANE + "\n" + tomli_w.dumps(table)


BALL = {"kind": "sphere", "radius": 0.1}
BAD = [
    ("clearance = -0.1", {"clearance": "0 .. 10"}),
    ("clearance = nan\ntool_clearance = '1 mm'",
     {"clearance": "0 .. 10", "tool_clearance": "1 mm"}),
    ("self = 1\nsurface = 'yes'", {"self": "true or false", "surface": "true or false"}),
    ("shapes = 'balls'", {"shapes": "'hulls', 'pieces' or 'meshes'"}),
    ("srdf = 3", {"srdf": "path of an SRDF"}),
    ("thickness = -1", {"thickness": "0 .. 10"}),
    ("tool_links = 'nozzle'", {"tool_links": "list of names"}),
    ("allow = [['a', 'a'], 'bc']", {"allow[0]": "different", "allow[1]": "different"}),
    ("clearances = [['a', 'b', 0.1]]", {"clearances[0]": "a table [collision.clearances[0]]"}),
    ("clearances = [{ pair = ['a', 'b'] }]", {"clearances[0].value": "is missing"}),
    ("clearances = [{ pair = ['a'], value = -1, x = 1 }]",
     {"clearances[0].pair": "two", "clearances[0].value": "0 .. 10", "clearances[0].x": "known"}),
    ("allow = [['a', 'b']]\nclearances = [{ pair = ['b', 'a'], value = 0 }]",
     {"clearances[0]": "also in allow"}),
    ("clearence = 0.1", {"clearence": 'did you mean "clearance"?'}),
    ("scene = 3\ntool = [3]", {"scene": "array", "tool[0]": "must be a table"}),
    ("scene = [{ name = 'a' }]", {"scene[0].kind": "is missing"}),
    ("scene = [{ name = 'a', kind = 'cone' }]", {"scene[0].kind": "'box', 'cylinder'"}),
    ("scene = [{ kind = 'sphere', radius = 1 }]", {"scene[0].name": "is missing"}),
    ("scene = [{ name = 'tool', kind = 'box' }]",
     {"scene[0].name": "pairs", "scene[0].size": "is missing"}),
    ("scene = [{ name = 'a', kind = 'box', size = [1, 1, 0], position = [0, nan, 0] }]",
     {"scene[0].size[2]": "> 0", "scene[0].position": "three finite numbers"}),
    ("scene = [{ name = 'a', kind = 'sphere', radius = 1, length = 2 }]",
     {"scene[0].length": "no key of a sphere; it has radius"}),
    ("scene = [{ name = 'a', kind = 'halfspace', frame = 3 }]",
     {"scene[0].frame": "the name of a link"}),
    ("tool = [{ kind = 'halfspace' }]", {"tool[0].kind": "'box', 'cylinder'"}),
    ("tool = [{ name = 'a', kind = 'sphere', radius = 0 }]",
     {"tool[0].name": "not known here", "tool[0].radius": "> 0"}),
    ("scene = [{ name = 'a', kind = 'mesh' }]", {"scene[0].file": "is missing"}),
]  # fmt: skip


@pytest.mark.parametrize(("lines", "wanted"), BAD)
def test_every_fault_has_its_key(lines, wanted):
    faults = faults_of(lambda: Case.from_toml(f"{PLANE}\n[collision]\n{lines}\n"))
    assert set(faults) == {f"collision.{key}" for key in wanted}
    for key, words in wanted.items():
        assert words in str(faults[f"collision.{key}"].message), key


def test_names_are_once_each():
    text = scene({"name": "a", **BALL}, {"name": "a", **BALL})
    assert "has 'a' 2 times" in faults_of(lambda: Case.from_toml(text))["collision.scene"].message


def test_names_are_judged_when_the_arm_is_loaded():
    text = scene(
        {"name": "wrist_1_link", **BALL}, tool_links=["wrist_9_link"],
        allow=[["forearm", "surface"], ["forearm_link", "surface"]],
        clearances=[{"pair": ["tool", "wrist_1_lnik"], "value": 0.1}],
    )  # fmt: skip
    case = Case.from_toml(text)
    faults = faults_of(case.build)
    assert set(faults) == {
        "collision.scene[0].name", "collision.tool_links[0]", "collision.allow[0]",
        "collision.clearances[0].pair",
    }  # fmt: skip


def test_a_mesh_that_cannot_be_used_is_named_beside_all_else(folder):
    text = scene(
        {"name": "a", "kind": "mesh", "file": "nowhere.stl"},
        {"name": "b", "kind": "mesh", "file": "fixture.stl"},
        tool=[{"kind": "mesh", "file": "fixture.stl", "scale": -1.0}],
    )
    faults = faults_of(lambda: load_case(write(folder, text)))
    assert set(faults) == {"collision.tool[0].scale", "collision.scene[0].file"}
    good = text.replace("-1.0", "0.001")
    faults = faults_of(load_case(write(folder, good)).build)
    assert set(faults) == {"collision.scene[0].file", "collision.scene[1].file"}
    assert "there is no such file" in faults["collision.scene[0].file"].message
    assert "300 m wide" in faults["collision.scene[1].file"].message
    spoiled = good.replace("standoff = 0.005", "standoff = -1")
    faults = faults_of(lambda: load_case(write(folder, spoiled)))
    assert {"collision.scene[0].file", "task.standoff"} <= set(faults)
