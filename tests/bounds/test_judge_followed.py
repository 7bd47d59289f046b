"""Motions that work over a surface and are lifted off it: right where they work, never through."""

from dataclasses import replace

import mesh_patches
import numpy as np
import pytest
from arm_urdfs import joint
from gantry import configurations, gantry, raster
from random_arms import robot_of

from coverable import Task, cylinder, mesh, parametric, plane, poses, verify
from feasibility.certification.followed import lifted_faults
from feasibility.certification.motion_replay import replay_over_surface
from robots.kinematics import Kinematics
from surfaces.meshes.triangle_mesh import TriangleMesh

OUT = {"side": "outside"}
TASK = Task(0.01, 20, 1e-3)
SLIDES = robot_of([joint(k, "prismatic", axis=x) for k, x in ((1, (1, 0, 0)), (2, (0, 0, 1)))])
FLOOR = plane((0.0, 1.0), (-1.0, 1.0), **OUT)
PIPE = cylinder(0.02, (-170, 170), (-1, 1), rpy_deg=(90, 0, 0), **OUT)  # along y, its seam to -x
VALLEY = mesh(TriangleMesh(*mesh_patches.bent(
    lambda u, v: (u - 0.5, v - 0.5, 0.1 * np.abs(u - 0.5)), 2, 1)), **OUT)  # fmt: skip
STEEP = replace(FLOOR, side="inside")
RIDGE = mesh(TriangleMesh(*mesh_patches.bent(
    lambda u, v: (u - 0.5, v - 0.5, np.maximum(0.1 - np.abs(u - 0.5), 0.0)), 10, 1)),
    **OUT)  # fmt: skip

LIFTED = {
    "above": (FLOOR, [(0.1, 0.05), (0.9, 0.05)], 0.0),
    "up": (FLOOR, [(0.1, 0.0), (0.1, 0.3), (0.9, 0.3)], 0.0),
    "down at a row": (FLOOR, [(0.1, 0.005), (0.3, -0.002), (0.9, 0.05)], 2e-3),
    "deep and deeper": (FLOOR, [(0.1, -0.0015), (0.3, -0.0018)], 1.8e-3),
    "on the other side": (STEEP, [(0.1, 0.002), (0.3, 0.05)], 0.05),
    "within the tolerance": (FLOOR, [(0.1, -0.0009), (0.9, -0.0009)], 0.0),
    "a chord of a pipe": (PIPE, [(-0.008735, 0.0181), (0.008735, 0.0181)], 1.9e-3),
    "across a pipe": (PIPE, [(-0.5, 0.0), (0.5, 0.0)], 0.02),
    "past a pipe": (PIPE, [(-0.5, 0.0195), (0.5, 0.0195)], 0.0),
    "over the border, from below": (FLOOR, [(-0.01, -0.0132), (0.002, 0.001)], 1.37e-3),
    "under a border that is not met": (FLOOR, [(-0.3, -0.2), (-0.001, -0.2)], 0.0),
    "under a border of triangles": (VALLEY, [(-0.9, -0.2), (-0.6, -0.2)], 0.0),
    "deep under a valley": (VALLEY, [(5e-4, -0.01), (5e-4, -0.0101)], np.hypot(5e-4, 0.0101)),
}  # fmt: skip


@pytest.mark.parametrize("name", LIFTED)
def test_a_tool_that_is_lifted_does_not_go_through(name):
    """It may be 1 mm deep; how deep it goes is said within a tenth."""
    surface, rows, deep = LIFTED[name]
    rows = np.array(rows)
    number = np.arange(len(rows) - 1.0)
    lifted = number, number + 1.0
    faults = lifted_faults(surface, rows, lifted, Kinematics(SLIDES), 1e-3)
    assert bool(faults) == (deep > 0.0), faults
    for fault in faults:
        said = float(fault.text.split(" by ")[1].split()[0])
        assert said <= 1e3 * deep * 1.002
        assert said >= 1.0
        if "row" in name or "deep" in name:
            assert said == pytest.approx(1e3 * deep, rel=1e-3)


def test_what_stays_open_is_no_clear_way():
    """Straight up from where it is as deep as it may be: no bound shows that, at the very start."""
    rows = np.array([[0.5, -1e-3 + 1e-11], [0.5, 0.1]])
    ends = np.zeros(1), np.ones(1)
    (fault,) = lifted_faults(FLOOR, rows, ends, Kinematics(SLIDES), 1e-3)
    assert "not certified" in fault.text
    assert not lifted_faults(FLOOR, rows, ends, Kinematics(SLIDES), 1.01e-3)
    assert not lifted_faults(None, rows, ends, Kinematics(SLIDES), 1e-3)


DOME = cylinder(0.3, (-170, 170), (-0.5, 0.5), rpy_deg=(90, 0, 0), **OUT)  # along y


def over(under, feet, normals, works):
    made = poses(feet, normals)
    return replace(made, surface=replace(made.surface, under=under, working=np.array(works, bool)))


def over_dome(angles_deg, lifted, works, under=DOME):
    """Poses across the top of a cylinder, some of them lifted by a height (m)."""
    angle = np.radians(angles_deg)
    normals = np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
    return over(under, normals * (0.3 + np.asarray(lifted))[:, None], normals, works)


def straight(cells, per=40):
    """The tool runs straight from pose to pose, as the curves of poses do."""
    points, approaches, _ = TASK.targets(cells)
    s = np.linspace(0.0, 1.0, per, endpoint=False)[:, None]
    line, axes = [], []
    for k in range(len(points) - 1):
        line.append((1 - s) * points[k] + s * points[k + 1])
        turn = np.arctan2(approaches[k : k + 2, 0], -approaches[k : k + 2, 2])
        at = turn[0] + s[:, 0] * (turn[1] - turn[0])
        axes.append(np.column_stack([np.sin(at), 0 * at, -np.cos(at)]))
    ends = np.vstack([*line, points[-1:]]), np.vstack([*axes, approaches[-1:]])
    marks = np.full(len(ends[0]), -1)
    marks[::per] = np.arange(len(points))
    return configurations(*ends), marks


ANGLES = [-24, -20, -16, -12, 0, 12, 16, 20, 24]
TOOLPATHS = {
    "all of it follows": (range(-20, 21, 4), [0.0] * 11, [1] * 11, DOME, ""),
    "wider apart than it bends": (range(-24, 25, 12), [0.0] * 5, [1] * 5, DOME, "off its surface"),
    "wider apart where it is lifted": (
        ANGLES, [0, 0, 0, 0, 0.03, 0, 0, 0, 0], [1, 1, 1, 0, 0, 0, 1, 1, 1], DOME, "",
    ),
    "through the dome where it is lifted": (
        [-80, -76, -72, 72, 76, 80], [0.0] * 6, [1, 1, 0, 0, 1, 1], DOME, "through the surface",
    ),
    "over what is not known": (range(-24, 25, 12), [0.0] * 5, [1] * 5, None, ""),
}  # fmt: skip


@pytest.mark.parametrize("name", TOOLPATHS)
def test_poses_over_a_surface_are_right_over_it_where_they_follow(name):
    """Between poses 12 degrees apart a straight line is 1.6 mm below the dome's offset."""
    angles, lifted, works, under, word = TOOLPATHS[name]
    cells = over_dome(angles, lifted, works, under)
    q, marks = straight(cells)
    found = replay_over_surface(gantry(), cells, TASK, q, marks=marks)
    assert found.accepted == (not word), found.refusal
    assert word in found.refusal
    assert verify(gantry(), cells, TASK, q, marks=marks[::-1]).holds == (not word)


@pytest.mark.parametrize(("off", "accepted"), [(5e-4, True), (1.1e-3, False)])
def test_in_a_hollow_as_round_as_the_standoff_is_the_place_that_the_tool_looks_at(off, accepted):
    """Targets lie 49 mm over a pipe of 50 mm: beside one the nearest is that of 26 deg further."""
    hollow = cylinder(0.05, (-130, -50), (0.0, 0.1), side="inside", rpy_deg=(90, 0, 0)).cells(5, 1)
    turn = np.radians(np.linspace(-123.0, -57.0, 67))
    axes = np.column_stack([np.cos(turn), 0 * turn, np.sin(turn)])
    points = 1e-3 * axes + off * np.cross(axes, [0, 1, 0]) + [0, -0.05, 0]
    task = Task(0.049, 5, tolerance=1e-3)
    found = replay_over_surface(gantry(), hollow, task, configurations(points, axes))
    assert found.accepted == accepted, found.refusal


@pytest.mark.parametrize(("deviation", "off", "accepted"), [
    (4e-4, 5e-4, True), (6e-4, 5e-4, False), (9e-4, 0.0, True), (1.1e-3, 0.0, False),
])  # fmt: skip
def test_what_the_surface_under_poses_deviates_by_is_taken_off(deviation, off, accepted):
    """Also where the tool is exactly right."""
    floor = parametric(lambda u, v: (u, v, 0 * u), (-0.5, 0.5), (-0.5, 0.5), **OUT)
    feet = np.linspace(-0.2, 0.2, 5)[:, None] * [1.0, 0.0, 0.0]
    up = np.tile([0.0, 0.0, 1.0], (5, 1))
    cells = over(replace(floor, off=(deviation, 0)), feet, up, np.ones(5))
    q, marks = straight(cells)
    q[:, 2] += off
    assert replay_over_surface(gantry(), cells, TASK, q, marks=marks).accepted == accepted


@pytest.mark.parametrize(("height", "word"), [(0.2, ""), (0.02, "through the surface")])
@pytest.mark.parametrize("back", [False, True])
def test_the_ways_on_and_off_a_surface_do_not_lead_through_it(height, word, back):
    """From before a ridge up and over it, and back at some height, in one segment each."""
    x, up = np.array([-0.45, -0.4, -0.4, 0.4, -0.35, -0.3]), np.tile([0.0, 0.0, 1.0], (6, 1))
    feet = np.column_stack([x, 0.0 * x, [0.0, 0.0, 0.3, height, 0.0, 0.0]])
    feet = feet[::-1] if back else feet
    cells = over(RIDGE, feet, up, [1, 1, 0, 0, 1, 1])
    q = configurations(feet + 0.01 * up, -up)
    found = replay_over_surface(gantry(), cells, TASK, q, marks=np.arange(6))
    assert found.accepted == (not word), found.refusal
    assert word in found.refusal


HOPS = {
    "over": ([(0.0, 0.2), (0.9, 0.2)], ""),
    "through": ([(0.0, 0.2), (2.0, 0.0), (-2.0, 0.0)], "through the surface"),
    "straight through": ([(-2.5, 0.0)], "through the surface"),
}


@pytest.mark.parametrize("name", HOPS)
def test_a_motion_over_cells_is_lifted_around_the_surface(name):
    """Where it works it is right over the ball; between, it may be anywhere but inside."""
    made, (way, word) = raster("ball"), HOPS[name]
    centre, k = made.cells.surface.position, 200
    first = made.q[k]
    hop = []
    for angle, height in way:
        normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
        hop.append(np.append(centre + (0.25 + height) * normal + [0, 0, 0.1], first[3:]))
    q = np.vstack([made.q[: k + 1], hop, made.q[k:]])
    working = np.r_[np.ones(k + 1), np.zeros(len(hop)), np.ones(len(made.q) - k)].astype(bool)
    found = replay_over_surface(made.robot, made.cells, made.task, q, working=working)
    assert found.accepted == (not word), found.refusal
    assert word in found.refusal
    assert not replay_over_surface(made.robot, made.cells, made.task, q).accepted
    off = q.copy()
    off[k // 2, 2] += 2e-3
    found = replay_over_surface(made.robot, made.cells, made.task, off, working=working)
    assert f"row {k // 2 + 1}: the tool point is" in found.refusal
