"""Shapes that are traps: each has its sentence, and no library is shown what it cannot take."""

import sys
from pathlib import Path

import hostile_visuals as hostile
import mesh_patches
import numpy as np
import pytest
from hulls_of_arms import assert_held
from mesh_writers import stl

from robots import RobotError, load_robot
from robots.shapes import Polytope, checked_triangles, link_pairs, link_shapes

opened: list[str] = []
sys.addaudithook(lambda event, facts: opened.append(str(facts[0])) if event == "open" else None)

LIGHT = [maker for maker in hostile.MAKERS if maker is not hostile.just_drawn]
BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'


@pytest.mark.parametrize("seed", range(1))
@pytest.mark.parametrize("maker", LIGHT, ids=lambda maker: maker.__name__)
def test_a_mesh_that_is_a_trap_is_a_note(maker, seed, tmp_path, capfd):
    """The link has a ball too, so that the arm is not refused."""
    path, words = hostile.make(maker, seed, tmp_path / "robot")
    text = Path(path).read_text().replace("<visual>", BALL + "<collision>")
    Path(path).write_text(text.replace("</visual>", "</collision>"))
    robot = load_robot(path)
    opened.clear()
    shapes = link_shapes(robot)
    mesh = text.split('filename="')[1].split('"')[0]
    inside = {Path(name).name for name in opened if name.startswith(str(tmp_path))}
    assert inside <= {"arm.urdf", mesh}, "nothing beside the mesh is opened"
    assert not [name for name in opened if name.startswith(("/dev", "/etc"))]
    assert capfd.readouterr() == ("", "")
    assert shapes.unchecked == (("base", "tip") if words else ("tip",))
    assert len(shapes.notes) == bool(words)
    assert len(shapes.solids) == 1 + (not words)
    assert_held(shapes)


NAN, INF = float("nan"), float("inf")
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])
REFUSED = {
    "no vertices": (np.empty((0, 3)), FACES, "names a vertex"),
    "no faces": (CORNERS, np.empty((0, 3), int), "has no triangles"),
    "nothing": (np.empty((0, 3)), np.empty((0, 3), int), "has no triangles"),
    "nan": (CORNERS + np.array([NAN, 0, 0]), FACES, "three finite numbers"),
    "one nan": (np.vstack([CORNERS, [0, NAN, 0]]), FACES, "three finite numbers"),
    "infinite": (np.full((4, 3), INF), FACES, "three finite numbers"),
    "minus infinite": (CORNERS - np.array([0, 0, INF]), FACES, "three finite numbers"),
    "huge": (CORNERS * 1e5, FACES, "more than 10000 m; if it is in millimetres"),
    "largest": (CORNERS * 1.7e308, FACES, "more than 10000 m"),
    "far away": (CORNERS + 1e9, FACES, "more than 10000 m"),
    "negative index": (CORNERS, FACES - 1, "names a vertex that it does not have"),
    "large index": (CORNERS, FACES + 1, "names a vertex that it does not have"),
    "largest index": (CORNERS, FACES + (2**62), "names a vertex that it does not have"),
    "one point": (np.ones((3, 3)), FACES[:1], "no triangle with an area"),
    "one corner": (CORNERS, np.zeros((5, 3), int), "no triangle with an area"),
    "an edge": (CORNERS, np.array([[0, 1, 1], [1, 0, 0]]), "no triangle with an area"),
    "a line": (np.outer([0, 1, 2], np.ones(3)), FACES[:1], "no triangle with an"),
    "points in a plane": (CORNERS[:, :2], FACES, "three finite numbers"),
    "quads": (CORNERS, np.array([[0, 1, 2, 3]]), "has no triangles"),
    "all at once": (np.full((4, 3), NAN), np.empty((0, 3), int), "2 faults"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_triangles_that_are_no_body_are_refused(name):
    vertices, faces, words = REFUSED[name]
    with np.errstate(all="ignore"), pytest.raises(RobotError, match=words):
        checked_triangles(vertices, faces, "hand.stl")


def grid(height):
    """Triangles over 20 x 20 points."""
    x, y, faces = mesh_patches.grid(19, 19)
    x, y = 19.0 * x, 19.0 * y
    return 0.01 * np.column_stack([x, y, height(x, y)]), faces


ODD = {
    "one triangle": (CORNERS, FACES[:1]),
    "flat": grid(lambda x, y: 0 * x),
    "all but flat": grid(lambda x, y: 1e-9 * x * y),
    "slanted": grid(lambda x, y: 0.3 * x - 0.7 * y),
    "a wave": grid(lambda x, y: np.sin(x)),
    "a hair thick": (CORNERS * [1, 1, 1e-12], FACES),
    "a needle": (CORNERS * [1, 1e-9, 1e-9], FACES),
    "tiny": (CORNERS * 1e-7, FACES),
    "as large as can be": (CORNERS * 1e4, FACES),
    "inside out": (CORNERS, FACES[:, ::-1]),
    "every face twice": (CORNERS, np.concatenate([FACES, FACES])),
    "degenerate faces between": (CORNERS, np.concatenate([FACES, [[0, 0, 1], [2, 2, 2]]])),
    "unused vertices": (np.concatenate([CORNERS, 5 + CORNERS]), FACES),
    "far from its frame": (0.1 * CORNERS + 5e3, FACES),
    "two bodies": (np.concatenate([CORNERS, 3 + CORNERS]), np.concatenate([FACES, 4 + FACES])),
    "one small and one large": (
        np.concatenate([1e-6 * CORNERS, 10 * CORNERS]),
        np.concatenate([FACES, 4 + FACES]),
    ),
}


@pytest.mark.parametrize("name", ODD)
def test_odd_bodies_have_hulls_that_coal_takes(name, tmp_path):
    """coal's own hull ends the process for flat points; here pairs are tested with each body."""
    (tmp_path / "odd.stl").write_bytes(stl(*ODD[name]))
    odd = '<collision><geometry><mesh filename="odd.stl"/></geometry></collision>'
    links = f'<link name="a">{BALL}</link><link name="b">{odd}</link><link name="c">{BALL}</link>'
    joints = "".join(
        f'<joint name="{a}{b}" type="continuous"><parent link="{a}"/><child link="{b}"/>'
        '<origin xyz="0 0 0.5"/><axis xyz="1 0 0"/></joint>'
        for a, b in ("ab", "bc")
    )
    (tmp_path / "arm.urdf").write_text(f'<robot name="odd">{links}{joints}</robot>')
    robot = load_robot(str(tmp_path / "arm.urdf"))
    for fineness in ("hulls", "pieces"):
        shapes = link_shapes(robot, fineness)
        assert (shapes.notes, shapes.unchecked) == ((), ())
        assert_held(shapes)
        pairs = link_pairs(robot, shapes)
        assert {out.why for out in pairs.left_out} == {"adjacent"}
        assert pairs.checked == (("a", "c"),)
    closed = name not in {
        "one triangle", "flat", "all but flat", "slanted", "a wave", "every face twice",
        "a hair thick", "a needle",
    }  # fmt: skip
    assert shapes.solids[1].geometry.closed is closed


@pytest.mark.parametrize(
    "vertices", [np.zeros((3, 3)), np.eye(3), np.zeros((9, 3)), np.outer(np.arange(5), [1, 2, 3.0])]
)
def test_flat_tools_do_not_end_the_process(vertices):
    robot = load_robot("puma560")
    tool = [Polytope("tool", 6, vertices, 0.001)]
    pairs = link_pairs(robot, link_shapes(robot), tool=tool)
    assert ("base", "tool") in pairs.checked
