"""Which pairs of links are asked for, how often the others collide, how far tools reach."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import trimesh
from samples import sampled, spread

from coverable import RobotError, load_robot
from robots.shapes.bodies import Solid
from robots.shapes.link_pairs import link_pairs
from robots.shapes.links import link_shapes, outer_bodies, tool_reach
from robots.shapes.solids import checked_triangles
from robots.urdf.link_shapes import Capsule, Sphere

SRDF = '<robot name="x">{}</robot>'
PAIR = '<disable_collisions link1="{}" link2="{}" {}/>'
FRAME = ("", "")
DRAWN = ('collision="none"', '<visual><geometry><sphere radius="0.05"/></geometry></visual>')


def arm(folder, *links):
    """Links l0, l1, ... one above the other by 0.3 m, each hinged about x on the one below."""
    text = "".join(
        f'<link name="l{k}" {mark}>{shapes}</link>' for k, (mark, shapes) in enumerate(links)
    )
    for k in range(1, len(links)):
        text += (
            f'<joint name="j{k}" type="revolute"><parent link="l{k - 1}"/><child link="l{k}"/>'
            '<origin xyz="0 0 0.3"/><axis xyz="1 0 0"/>'
            '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        )
    (folder / "arm.urdf").write_text(f'<robot name="arm">{text}</robot>')
    return load_robot(str(folder / "arm.urdf"))


def ball(radius=0.05, z=0.0):
    origin = f'<origin xyz="0 0 {z}"/>'
    return "", f'<collision>{origin}<geometry><sphere radius="{radius}"/></geometry></collision>'


def sorted_out(pairs):
    return {(out.first, out.second): out.why for out in pairs.left_out}


@pytest.mark.parametrize("name", ["puma560", "panda", "ur5"])
def test_every_pair_is_asked_for_or_left_out_once(name):
    robot = load_robot(name)
    shapes = link_shapes(robot)
    pairs, joint = link_pairs(robot, shapes), {body.owner: body.joint for body in shapes.polytopes}
    listed = [frozenset(pair) for pair in (*pairs.checked, *sorted_out(pairs))]
    assert len(listed) == len(set(listed))
    assert set(listed) == {frozenset(pair) for pair in combinations(joint, 2)}
    for out in pairs.left_out:
        rigid = joint[out.first] == joint[out.second]
        assert (out.why == "rigid") is (out.rate is None) is rigid
    if name == "ur5":  # deep inside each other: coal misses a third where no contacts are asked
        rates = {(out.first, out.second): out.rate for out in pairs.left_out}
        assert rates["upper_arm_link", "forearm_link"] == 1.0


def test_neighbours_are_adjacent_also_through_frames_but_not_through_bodies(tmp_path):
    robot = arm(tmp_path, ball(), ball(), FRAME, ball(), DRAWN, ball())
    pairs = link_pairs(robot, link_shapes(robot))
    assert sorted_out(pairs) == {("l0", "l1"): "adjacent", ("l1", "l3"): "adjacent"}
    assert set(pairs.checked) == {("l0", "l3"), ("l0", "l5"), ("l1", "l5"), ("l3", "l5")}


def test_pairs_that_always_collide_are_left_out_and_said(tmp_path):
    large = ball(0.5)
    robot = arm(tmp_path, large, ball(), large, ball(0.01, 0.29))
    pairs = link_pairs(robot, link_shapes(robot))
    assert sorted_out(pairs)["l0", "l2"] == "always"
    rates = {(out.first, out.second): out.rate for out in pairs.left_out}
    assert rates["l0", "l2"] == 1.0
    (note,) = pairs.notes
    assert "in each of 1,000 random configurations: l0 - l2;" in note
    assert ("l0", "l3") in pairs.checked, "folded up it is inside, stretched out it is not"


def test_hulls_alone_leave_no_pair_out_and_tools_are_asked_for_exactly(tmp_path):
    """A ring around the arm: its hull holds all of it, the ring itself is never touched."""
    ring = trimesh.creation.annulus(2.0, 2.1, 4.0)
    ring.export(tmp_path / "ring.stl")
    mesh = '<collision><geometry><mesh filename="ring.stl"/></geometry></collision>'
    robot = arm(tmp_path, ("", mesh), ball(), ball(), ball())
    pairs = link_pairs(robot, link_shapes(robot))
    assert set(pairs.checked) == {("l0", "l2"), ("l0", "l3"), ("l1", "l3")}
    (note,) = pairs.notes
    assert "exact shapes do not: l0 - l2, l0 - l3; the search finds nothing" in note
    robot = arm(tmp_path, ball(0.5), ball(), ball(0.01))
    alone, solid_ring = link_shapes(robot), checked_triangles(ring.vertices, ring.faces)
    for geometry, why in ((solid_ring, None), (Sphere(0.4), "always")):  # on the last link
        solid = Solid("tool", robot.n, np.eye(4), geometry)
        more = (*alone.polytopes, *outer_bodies(solid))
        shapes = replace(alone, solids=(*alone.solids, solid), polytopes=more)
        pairs = link_pairs(robot, shapes)
        assert sorted_out(pairs).get(("l0", "tool")) == why


def test_users_and_srdfs_leave_pairs_out_with_their_rates(tmp_path):
    robot = arm(tmp_path, *[ball(0.1)] * 5)
    asked = (("l4", "l0", "User"), ("l0", "l3", "Never"), ("l1", "l4", "Never"),
             ("l0", "l1", "Adjacent"))  # fmt: skip
    lines = [PAIR.format(a, b, f'reason="{why}"') for a, b, why in asked]
    (tmp_path / "arm.srdf").write_text(SRDF.format("".join([*lines, PAIR.format("l1", "l3", "")])))
    allow = [("l3", "l1"), ("l2", "shelf")]
    pairs = link_pairs(robot, link_shapes(robot), allow, tmp_path / "arm.srdf")
    reasons = sorted_out(pairs)
    assert (reasons["l1", "l3"], reasons["l0", "l4"]) == ("allowed", "srdf")
    assert reasons["l0", "l1"] == "adjacent"
    assert {("l0", "l3"), ("l1", "l4"), ("l0", "l2")} <= set(pairs.checked)
    # Two hinges apart, balls of 0.1 m at the hinges, 0.3 m links: they touch where
    # 0.3 sqrt(2 - 2 cos(pi - q)) < 0.2, so for |q| > pi - 2 asin(1 / 3).
    touching = (3.0 - (np.pi - 2 * np.arcsin(1 / 3))) / 3.0
    (rate,) = (out.rate for out in pairs.left_out if (out.first, out.second) == ("l1", "l3"))
    assert rate == pytest.approx(touching, abs=0.04)
    assert pairs.notes == (
        "2 pairs are not taken from the SRDF, which gives the reason 'Never'",
        "1 pair is not taken from the SRDF, which gives no reason",
    )


def test_an_srdf_of_another_arm_is_an_error(tmp_path, approved):
    robot = arm(tmp_path, ball(), ball(), ball())
    file = tmp_path / "other.srdf"
    file.write_text(SRDF.format(PAIR.format("panda_link0", "l1", 'reason="Never"')))
    with pytest.raises(RobotError) as caught:
        link_pairs(robot, link_shapes(robot), (), file)
    approved("bad_pairs", str(caught.value))


# Arm: link, mm beyond the tool point.
REACH = {
    "ur5": ("wrist_3_link", -0.5), "xarm7": ("link7", 0.0), "panda": ("panda_leftfinger", 9.5),
    "kinova": ("j2s6s200_link_finger_tip_1", 2.4), "puma560": ("link6", -8.0),
}  # fmt: skip


@sampled("name", spread([*REACH], 4))
def test_how_far_tools_reach_beyond_their_point(name):
    robot = load_robot(name)
    reaches = tool_reach(robot, link_shapes(robot).solids)
    assert [*reaches.values()] == sorted(reaches.values(), reverse=True)
    owner, beyond = REACH[name]
    assert next(iter(reaches.items())) == (owner, pytest.approx(1e-3 * beyond, abs=6e-5))
    if name == "puma560":  # a tool of the user reaches too
        rod = Solid("tool", 6, np.eye(4), Capsule(0.002, 0.06))
        first = next(iter(tool_reach(robot, [*link_shapes(robot).solids, rod]).items()))
        assert first == ("tool", pytest.approx(0.032))
