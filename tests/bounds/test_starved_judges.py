"""Each quantity that a judge takes off its allowance is made absurdly large: nothing is accepted.

A judge that forgets a margin still accepts what is right, so that tests of right motions do not
notice; nor do dense samples, which stay far below most bounds. Starved of its allowance it must
refuse. Each test first shows that the judge accepts what is not starved.
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from arm_urdfs import joint
from bounds import LARGE, Starved, grown
from capsule_arms import at, bodies_of, capsule_links, fork, pair, planar_arm
from gantry import configurations, gantry, raster
from random_arms import robot_of

from coverable import Obstacle, Task, parametric, plane
from feasibility.certification.collisions.collision_replay import Couples, collision_replay
from feasibility.certification.collisions.motion import ArmMotion
from feasibility.certification.motion_replay import replay_over_surface
from feasibility.certification.rate_replay import in_place
from feasibility.certification.roll_box_models import Directions, ToolModel, roll_models
from feasibility.certification.roll_held import largest_off
from feasibility.certification.segment_rates import segment_rates
from feasibility.certification.stretches import Judge
from feasibility.collisions.problem_bodies import Soup
from feasibility.demands.area import treated_by_walk
from feasibility.roll import Roll
from feasibility.verdict import Walk
from robots.kinematics import Kinematics
from robots.shapes.bodies import Solid, Triangles
from robots.urdf.link_shapes import Box, Sphere

FAR = 9e3  # m, of an axis: as far as a URDF may put it
PLANAR, LINKS = planar_arm((0.5, 0.4)), capsule_links((0.5, 0.4), 0.03)
SLIDE = planar_arm([0.1], ["prismatic"])
ROWS = np.array([[0.3, 0.0], [0.2, 0.1], [0.1, 0.2]])  # of the planar arm
CORNERS = np.array([[0.3, 0.8, -0.1], [0.3, 0.8, 0.1], [0.5, 0.9, 0], [0.5, 1, 0.1]])  # of a sheet
FACES = np.array([[0, 1, 2], [1, 2, 3]])
HELD = {"roll_deg": (-170, 170), "roll_reference": (1, 0, 0)}


@pytest.mark.parametrize(("name", "held", "bent"), [
    ("ball", {}, (0, 1)), ("mesh", {}, (0, 1)), ("ball", HELD, (0, 1, 2)),
    ("plane", {"roll_deg": (-90, 90)}, (0, 1, 2)),
])  # fmt: skip
def test_stretches_of_a_motion(name, held, bent):
    """What tool point, axis, roll (`bent`), places and the u direction may do between rows."""
    robot, cells, task, q = raster(name)
    surface, share = cells.surface, np.linspace(0, 1, 20)[:, None]
    task, rows = replace(task, tolerance=2e-3, **held), q[40:60]
    rows = np.vstack([a + share * (b - a) for a, b in itertools.pairwise(rows)])
    judge = Judge(robot, task, surface, cells, rows)
    offset = judge.offset
    parts = judge.between_rows(judge.at_rows())
    assert judge.within(judge.bounds(parts)).all()
    for column in bent:
        bounds = judge.bounds(replace(parts, of_segment=grown(parts.of_segment, column)))
        assert not judge.within(bounds).any()
        assert column or not (np.isfinite(bounds.facets) & (bounds.facets > 0.0)).any()
    away = replace(parts, end=replace(parts.end, points=parts.end.points + LARGE))
    facets = judge.bounds(away).facets
    assert not (np.isfinite(facets) & (facets > task.standoff - task.effective_tolerance)).any()

    def unknown(column):
        return lambda path: replace(path, deviations=grown(path.deviations, column))

    for column in (0, 1, 2) if held and "roll_reference" not in held else (0, 1):
        judge.offset = Starved(offset, "paths", unknown(column))
        assert not judge.within(judge.bounds(parts)).any()
    if not offset.bends_evenly:  # as near to a model, and no nearer, at the ends
        near = {"deviations": np.full((len(parts.row), 3, 3), 1e-4)}
        judge.offset = Starved(offset, "paths", lambda path: replace(path, **near))
        aside = replace(parts, end=replace(parts.end, points=parts.end.points + 0.01))
        off = np.linalg.norm(aside.end.points - judge.targets(aside.end.places)[0], axis=1)
        assert (judge.bounds(aside).error > off + 0.99e-4).all()


@pytest.mark.parametrize(("off", "standoff", "cone", "accepted"), [
    ((9e-4, 0), 0.02, 30, True), ((1.1e-3, 0), 0.02, 30, False), ((0, 0.04), 0.02, 30, True),
    ((0, 0.06), 0.02, 30, False), ((0, 0.5), 0.0, 30, True), ((0, 0.53), 0.0, 30, False),
])  # fmt: skip
def test_what_a_surface_deviates_by(off, standoff, cone, accepted):
    """Off the points, which leaning normals move by the standoff; and off the cone."""
    flat = parametric(lambda u, v: (u, v, 0 * u), (0.4, 0.6), (-0.1, 0.1), side="outside")
    task, cells = Task(standoff, cone), replace(flat, off=off).cells(2, 1)
    points = cells.centres + np.array([0.0, 0.0, standoff])
    q = configurations(points, np.tile([0.0, 0.0, -1.0], (2, 1)))
    for tip in (0.0, 1e-5):
        q[1, 4] += tip
        found = replay_over_surface(gantry(), cells, task, q)
        assert found.accepted == accepted, found.refusal


def test_a_roll_between_two_instants_and_over_boxes():
    z, none = np.array([[2.0, 0.0]]), np.zeros((1, 2))
    assert np.isfinite(largest_off(z, z, np.zeros(1), none, 0.5))
    assert not np.isfinite(largest_off(z, z, np.full(1, LARGE), none, 0.5))
    for end in (0, 1):
        assert not np.isfinite(largest_off(z, z, np.zeros(1), grown(none, end), 0.5))
    x, y, b = np.eye(3)
    bits = np.full((1, 2), 0.01)
    tool = ToolModel(np.stack([x, y])[None], np.full((1, 6, 2, 3), 0.1), bits, bits)
    b, t = (Directions(one[None], np.full((1, 2, 3), 1e-3), bits[0, :1]) for one in (b, x))

    def radius(tool=tool, b=b, t=t, half=100 * bits):
        return roll_models(tool, b, t, half, Roll(0.3, 0.5)).radius

    assert (radius() < 1.1).all()
    for k in (0, 1):
        for starved in ({"second": grown(bits, k)}, {"moves": grown(bits, k)}):
            assert (radius(tool._replace(**starved)) >= 2.0).all()  # |F - 1| is never more than 1
        assert (radius(half=grown(bits, k)) >= 2.0).all()
        less_known = {"bt"[k]: replace((b, t)[k], radius=np.array([LARGE]))}
        assert (radius(**less_known) >= 2.0).all()


@pytest.mark.parametrize(("turn", "asked"), [(2.5, {"speed": 0.05}), (0.0, {"sigma": 0.2})])
@pytest.mark.parametrize(("far", "accepted"), [(0.0, True), (FAR, False)])
def test_rates_of_an_arm_with_an_axis_far_away(turn, asked, far, accepted):
    """Two axes in one line that rest, or turn against each other: to the tool it is the same."""
    first = [joint(1), *(joint(k, xyz=(0.3, 0, 0.1), axis=(0, 1, 0)) for k in (2, 3, 4))]
    last = [joint(5, xyz=(0.1, 0, 0), axis=(1, 0, 0)), joint(6, "prismatic", xyz=(0.1, 0, 0))]
    twice = [joint(7, xyz=(far, 0, 0)), joint(8), joint(9, "fixed", (0.1 - far, 0, 0.05))]
    robot = robot_of([*first, *last, *twice])
    robot = robot.with_limits({"j6": (-np.inf, np.inf)})  # so that lengths are measured by 1 m
    start = np.array([[0.1, -0.4, 0.9, 0.3, 0.4, 0.2, 0.0, 0.0]])
    end = start + np.array([0.2, 0.1, -0.1, 0.2, 0.1, 0.1, turn, -turn])
    found = segment_rates(robot, start, end, **asked)
    assert found.sampled_speed[0] > 0.05
    assert found.sampled_sigma[0] > 0.2
    assert all((getattr(found, name)[0] >= least) == accepted for name, least in asked.items())
    tool, _ = Kinematics(robot).tool(start[0])
    spot = plane((0, 1), (0, 1), "outside", tool - (0.5, 0.5, 0.02)).cells(1, 1)
    rests = start + np.outer([0, 1], [0, 0, 0, 0, 0, 0, 0.05, -0.05])
    assert in_place(robot, spot, Task(0.02, 30), rests)[0] == accepted


def fed(bodies, arm, rows, name):
    """The first two bodies of a scene along a motion, as they are and starved of `name`."""
    motion = ArmMotion(arm, rows)

    def worse(chords):
        hungry = [name, "delta"] if name == "moved" else [name]  # either bounds the way of points
        return chords._replace(**{one: 1e3 * grown(getattr(chords, one)) for one in hungry})

    for one in (motion, Starved(motion, "chords", worse)):
        yield Couples(bodies).along(one)[0]


@pytest.mark.parametrize("name", ["delta", "deviation"])
@pytest.mark.parametrize("thing", [Box((0.2, 0.2, 0.2)), Triangles(CORNERS, FACES, False)])
def test_balls_and_planes_that_part_bodies(name, thing):
    """How far points may leave the chord, and be moved by joints off the line besides."""
    wall = Obstacle("wall", thing, at() if isinstance(thing, Triangles) else at(0.3, 0.8))
    found, n = [], np.array([[0.4, -0.7, 0.0]])
    for one in fed(bodies_of(LINKS, [wall], [pair("link2", "wall")]), PLANAR, ROWS, name):
        ends = np.array([[0.0, 1.0], [1.0, 2.0], [0.5, 0.6]])
        found.append([*one.low, *one.parted(ends, np.tile(n, (3, 1)))])
    assert (np.array(found[0]) > 0.1).all()
    assert (np.array(found[1]) < 0.0).all()


@pytest.mark.parametrize("name", ["moved", "deviation"])
def test_steps_of_a_hollow_body(name):
    """A post between the arms of a fork that slides along it, which no plane parts."""
    bodies = bodies_of([Solid("link1", 1, at(), fork())], [Obstacle("post", Sphere(0.1), at())],
                       [pair("link1", "post", 0.1)])  # fmt: skip
    rows = np.array([[-0.3], [0.3]])
    for one, accepted in zip(fed(bodies, SLIDE, rows, name), (True, False), strict=True):
        one.certify(0.2)
        assert (one.refused is None) == accepted


def test_a_motion_among_bodies():
    """The clearance, what a sheet stands out by, and how far joints are off the line."""

    def accepted(clearance=0.01, stands_out=0.0, off=0.0):
        soup = Soup("wall", CORNERS[FACES], stands_out, False)
        bodies = bodies_of(LINKS, soups=[soup], pairs=[pair("link2", "wall", clearance)])
        return collision_replay(PLANAR, bodies, ROWS, np.full((2, 2), off)).accepted

    assert accepted()
    assert not accepted(clearance=LARGE)
    assert not accepted(stands_out=LARGE)
    assert not accepted(off=LARGE)


def test_a_treated_area():
    """How far the path on the surface may be from the places that were looked at."""
    robot, cells, task, q = raster("plane")
    task = replace(task, footprint=0.2)
    walk = Walk(q, np.full(len(q), -1))
    assert treated_by_walk(robot, cells, task, walk).lower > 0.9
    spun = q[-1:] + 2 * np.pi * np.eye(6)[5:] * 1e6  # more than any number of rows can follow
    long = replace(walk, q=np.vstack([q, spun]), cell=np.append(walk.cell, -1))
    assert treated_by_walk(robot, cells, task, long).lower == 0.0
