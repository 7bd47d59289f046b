"""What bounds in the judge of collisions: how bodies move between rows, what parts them."""

from itertools import pairwise

import numpy as np
import pytest
from bounds import holds
from capsule_arms import at, bodies_of, box_mesh, fork, pair, planar_arm
from mesh_patches import of_patch
from random_arms import seen
from referee import unit

from coverable import Obstacle, load_robot, sphere
from feasibility.certification.collisions.collision_replay import Couples, collision_replay
from feasibility.certification.collisions.judged_shapes import Body
from feasibility.certification.collisions.motion import ArmMotion
from feasibility.collisions.problem_bodies import Soup
from robots.shapes.bodies import Solid
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

UR5 = load_robot("ur5")
COAL = 1e-7  # m, what coal's distances may be off


def how_far(robot, rows, deviations, a, b, points, rng):
    """m, that points leave their chords, move, and move besides where joints deviate."""
    t = np.linspace(0, 1, 41)[:, None]
    straight = rows[0] + t * (rows[1] - rows[0])
    at_t = seen(robot, straight, a, b, points)
    chords = at_t[0] + t[:, :, None] * (at_t[-1] - at_t[0])
    bent = straight + rng.choice([-1, 1], straight.shape) * deviations
    off = [at_t - chords, at_t - at_t[0], seen(robot, bent, a, b, points) - at_t]
    return [np.linalg.norm(each, axis=2).max() for each in off]


def bends(robot, rows, a, b, centre, ball, deviations=None):
    """m, what is said of a ball on joint b along the one segment, seen from joint a."""
    motion = ArmMotion(robot, rows, deviations)
    chords = motion.chords(np.array([b]), np.array([centre]), np.array([ball]))
    return [one[a, 0, 0] for one in chords]


def some_arms(rng):
    """The UR5, and chains with sliding joints along and across."""
    yield UR5
    for _ in range(3):
        kinds = rng.choice(["revolute", "revolute", "prismatic"], 5).tolist()
        axes = [tuple(np.round(rng.normal(size=3), 3).tolist()) for _ in kinds]
        yield planar_arm(rng.uniform(0.1, 0.6, 5).tolist(), kinds, axes)


@pytest.mark.parametrize("step", [0.001, 0.03, 0.5])
def test_no_point_moves_or_leaves_its_chord_further(step):
    rng, bounds, truths = np.random.default_rng(7), [], []
    for robot in some_arms(rng):
        q = rng.uniform(-2, 2, robot.n)
        for _ in range(12):
            a, b = np.sort(rng.choice(robot.n + 1, 2, replace=False)).tolist()
            rows = np.vstack([q, q + step * rng.normal(size=robot.n)])
            centre, ball = rng.normal(size=3) * 0.3, rng.uniform(0.01, 0.3)
            deviations = step * 0.2 * rng.random((1, robot.n))
            points = centre + ball * unit(rng.normal(size=(60, 3)))
            bounds.append(bends(robot, rows, a, b, centre, ball, deviations))
            truths.append(how_far(robot, rows, deviations, a, b, points, rng))
            q = q + step * rng.normal(size=robot.n)
    for bound, truth in zip(np.transpose(bounds), np.transpose(truths), strict=True):
        holds(bound, truth, 0.6)


def test_joints_that_deviate_move_a_point_by_their_levers():
    """Two links in line: 0.6 m and 0.3 m from the axes, both joints off by 0.1 rad."""
    robot, tip = planar_arm([0.3, 0.3]), np.array([[0.3, 0.0, 0.0]])
    found = bends(robot, np.zeros((2, 2)), 0, 2, tip[0], 0.0, np.array([[0.1, 0.1]]))[2]
    ends = seen(robot, np.array([[0.0, 0.0], [0.1, 0.1]]), 0, 2, tip)
    holds(found, np.linalg.norm(ends[1] - ends[0]), 0.95)


SHAPES = [Box((0.1, 0.06, 0.3)), Sphere(0.05), Capsule(0.03, 0.2), Cylinder(0.04, 0.1),
          box_mesh((0.1, 0.06, 0.3)), box_mesh((0.1, 0.06, 0.3), False)]  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_bodies_reach_no_further_than_is_said(shape):
    """By planes across any direction, and by balls: coal's distance from a tiny ball far away."""
    rng = np.random.default_rng(1)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    body = Body(Solid("", 0, at(0.1, 0.2, 0.3, turn * np.sign(np.linalg.det(turn))), shape))
    n = unit(rng.normal(size=(40, 3)))
    dot, far = Body(Solid("", 0, np.eye(4), Sphere(1e-6))), 1e4  # its distance is a height
    places = dot.placed(np.tile(np.eye(3), (40, 1, 1)), far * n)
    reach = np.array([far - 1e-6 - body.distance(dot, place)[0] for place in places])
    holds(body.highest(n) + 1e-5, reach, 0.999)
    assert (reach - n @ body.centre <= body.ball + 1e-5).all()
    assert (reach - n @ body.centre).max() >= 0.9 * body.ball


def pairings(robot, rows, solid, others, deviations=None, needed=0.0, soups=()):
    """What is known of a body and each of some others along a motion."""
    pairs = [pair(solid.owner, other.name, needed) for other in others]
    pairs += [pair(solid.owner, soup.owner, needed) for soup in soups]
    motion = ArmMotion(robot, np.array(rows, float), deviations)
    return Couples(bodies_of([solid], others, pairs, soups)).along(motion)


@pytest.mark.parametrize(
    ("end", "place", "size", "used"),
    [((0.0, 0.1), 0.0, 0.3, 0.8), ((0.1, -0.1), 0.4, 0.01, 0.8), ((6.28, 0.0), 0.4, 0.01, 0.3)],
    ids=["about its middle", "without a turn", "there and back"],
)
def test_no_point_of_a_body_moves_further_than_its_way(end, place, size, used):
    robot, rows = planar_arm([0.5, 0.4]), np.array([[0.0, 0.0], end])
    solid = Solid("link2", 2, at(place), Box((size, size, size)))
    wall = Obstacle("wall", Sphere(0.1), at(2.0))
    (one,) = pairings(robot, rows, solid, [wall])
    corners = one.b.corners
    moved = how_far(robot, rows, np.zeros((1, 2)), 0, 2, corners, np.random.default_rng(0))[1]
    holds(one.way[-1], moved, used)


@pytest.mark.parametrize("step", [0.01, 0.2])
def test_no_bound_is_above_a_distance(step):
    """By balls, and by planes on whole segments and on parts of them, of bodies on any joints."""
    rng, spare = np.random.default_rng(5), []
    q = np.cumsum(np.vstack([rng.uniform(-1, 1, 6), step * rng.normal(size=(3, 6))]), axis=0)
    things = [Obstacle(f"thing{k}", one, at(*rng.uniform(-0.4, 0.4, 3))) for k, one in
              enumerate(SHAPES)]  # fmt: skip
    for joint in (1, 3, 6):
        for shape in SHAPES:
            solid = Solid("link", joint, at(*rng.uniform(-0.1, 0.1, 3)), shape)
            for one in pairings(UR5, q, solid, things):
                for first, last in ((0.0, 1.0), (1.25, 1.75), (2.5, 3.0)):
                    times = np.linspace(first, last, 9)
                    truth = one.lines(times)[0].min()
                    n = rng.normal(size=3) if truth <= 0.0 else one.gaps(*one.motion.poses(
                        one.a.joint, one.b.joint, times[4:5]))[1][0]  # fmt: skip
                    found = one.parted(np.array([[first, last]]), n[None])[0]
                    spare.append((truth + COAL - one.low[int(first)], truth + COAL - found))
    assert np.min(spare) >= 0.0
    assert (np.quantile(spare, 0.1, axis=0) < 0.1).all()


def in_a_dome(rng, body):
    """An arm, a walk of it, the body that it carries, and a quarter of a sphere of radius 1 m."""
    robot = planar_arm([0.3, 0.4, 0.1], ["revolute", "revolute", "prismatic"])
    steps = rng.normal(size=(60, 3)) * [0.08, 0.08, 0.02]
    walk = np.array([0.6, 0.3, 0.2]) + np.cumsum(steps, axis=0)
    made = of_patch(sphere(1.0, np.degrees((0.3, 1.5)), (0, 180), "outside"), 20, 20)
    soup = Soup("surface", made.vertices[made.faces], 0.0, False)
    return robot, walk, Solid("tool", 3, at(0.05), body), soup


@pytest.mark.parametrize("off", [0.0, 0.01])
@pytest.mark.parametrize("body", SHAPES[:4], ids=lambda body: type(body).__name__)
def test_clearance_of_many_triangles_is_never_above_the_distance_and_seldom_far_below(body, off):
    """A body that turns and slides inside a dome: coal at samples of each stretch."""
    robot, walk, solid, soup = in_a_dome(np.random.default_rng(3), body)
    for start in range(0, 60, 20):
        rows = walk[start : start + 6]
        q = np.concatenate([np.linspace(*ends, 10) for ends in pairwise(rows)])
        bent = [q + np.array([0.0, 0.0, way]) for way in (-off, 0.0, off)]
        ways = [pairings(robot, one, solid, [], None, 0.0, [soup]) for one in bent]
        times = np.arange(float(len(q)))
        truth = min(one.lines(times)[0].min() for (one,) in ways)
        for needed in (0.5 * max(truth, 0.0), max(truth, 0.0) + 1e-4):
            bodies = bodies_of([solid], [], [pair("tool", "surface", needed)], [soup])
            deviations = np.full((len(rows) - 1, 3), [0.0, 0.0, off])
            found = collision_replay(robot, bodies, rows, deviations)
            assert needed < truth or not found.accepted
            assert found.accepted or truth - needed < 2.0 * off + 1e-6
            if found.accepted:
                assert 0.8 * truth - 2.0 * off <= found.min_clearance <= truth + COAL


@pytest.mark.parametrize("more", [0.05, 0.15])
def test_the_most_that_joints_deviate_along_a_stretch_counts(more):
    """A post between the arms of a fork, 0.2 m from both; the last segment is very short."""
    solid = Solid("link1", 1, at(), fork())
    bodies = bodies_of([solid], [Obstacle("a", Sphere(0.1), at())], [pair("link1", "a", 0.1)])
    slide, rows = planar_arm([0.1], ["prismatic"]), np.array([[-0.3], [0.2999], [0.3]])
    found = collision_replay(slide, bodies, rows, np.array([[0.0], [more]]))
    assert found.accepted == (more < 0.1)


@pytest.mark.parametrize("calls", [4, 40, 4000])
def test_a_closer_look_certifies_no_more_than_there_is(calls):
    """A bar in a dome, asked for other distances along each segment, with few calls and many."""
    rng, raised = np.random.default_rng(calls), 0
    robot, walk, solid, soup = in_a_dome(rng, SHAPES[0])
    for start in range(0, 60, 6):
        rows = walk[start : start + 6]
        q = np.concatenate([np.linspace(*ends, 15) for ends in pairwise(rows)])
        (one,), (fine,) = (pairings(robot, x, solid, [], None, 0.0, [soup]) for x in (rows, q))
        truth = fine.lines(np.arange(len(q), dtype=float))[0].reshape(-1, 15).min(axis=1)
        one.certify(0.0)
        if one.refused is not None:
            continue
        before, more = one.low.min(), truth * rng.uniform(0.3, 1.5, len(truth))
        for one.needed in (0.0, 2.0 * truth.max()):  # the latter is refused
            one.look_closer(more + one.needed, calls)
            assert (one.low <= truth + 1e-6).all()
        raised += one.low.min() > before
    assert raised or calls == 4
