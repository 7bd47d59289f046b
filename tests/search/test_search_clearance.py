"""The clearance that the search compiles: what it calls clear is clear for coal at every sample."""

from collections import defaultdict
from itertools import product

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from arm_urdfs import joint
from numpy.typing import NDArray
from random_arms import between, planar_arm, robot_of, seen
from samples import sampled, spread
from search_kernels import Clearance

from coverable import Collision, Obstacle, Robot, load_robot, sphere
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.kernels import link_frames
from feasibility.collisions.kernels.tables import GROUPS, row, views
from feasibility.collisions.problem_bodies import Bodies, Pair, Soup
from robots.shapes.bodies import Polytope

LENGTH, RADIUS = 0.3, 0.03  # m, of each link, a capsule along x
chord_deviation, place_bodies = link_frames.chord_deviation, link_frames.place_bodies
place_group = link_frames.bound_levers
FINE = np.deg2rad(0.1)  # between samples, of the joint that moves most


# Bodies of made-up shapes on real and made-up arms, and what coal says of them.


def serial_arm(rng: np.random.Generator, kinds: str, length: float = 0.3) -> Robot:
    """A chain of joints, R or P, with axes and placements made up."""
    named = {"R": "revolute", "P": "prismatic"}
    joints = [joint(k, named[kind], *rng.normal(size=(2, 3)) * [[length], [1.0]],
                    rng.normal(size=3), (-3, 3)) for k, kind in enumerate(kinds, 1)]  # fmt: skip
    return robot_of(joints)


def hulls(rng: np.random.Generator, n: int, size: float = 0.08, at: float = 0.15) -> list[Polytope]:
    """One to three clouds of vertices around each joint, the root included: owners b0 to bn."""
    bodies = []
    for k in range(n + 1):
        for _ in range(int(rng.integers(1, 4))):
            count = int(rng.integers(4, 30))
            cloud = rng.normal(size=(count, 3)) * size * rng.uniform(0.2, 1.0, 3)
            cloud += rng.normal(size=3) * at
            bodies.append(Polytope(f"b{k}", k, cloud, float(rng.choice([0.0, 0.02]))))
    return bodies


def all_pairs(owners: int, clearance: float) -> tuple[Pair, ...]:
    """Every pair of b0 to b(owners - 1) that is not adjacent."""
    return tuple(
        Pair(f"b{k}", f"b{i}", clearance) for i in range(owners) for k in range(i + 2, owners)
    )


def of_polytopes(bodies: list[Polytope], pairs: tuple[Pair, ...], *soups: Soup) -> Bodies:
    """Bodies with nothing for the judge."""
    return Bodies((), tuple(bodies), soups, (), pairs)


class CoalScene:
    """The same polytopes and soups as coal sees them, placed by Pinocchio."""

    def __init__(self, robot: Robot, bodies: Bodies) -> None:
        self.robot, self.bodies, self.data = robot, bodies, robot.model.createData()
        self.shapes = defaultdict(list)
        for body in bodies.polytopes:
            points = coal.StdVec_Vec3s()
            points.extend(list(body.vertices))
            shape = coal.Convex.convexHull(points, False, None)
            self.shapes[body.owner].append((body.joint, shape, body.radius))
        for soup in bodies.soups:
            model = coal.BVHModelOBBRSS()
            model.beginModel(len(soup.triangles), 3 * len(soup.triangles))
            for corners in soup.triangles:
                model.addTriangle(*corners)
            model.endModel()
            self.shapes[soup.owner].append((0, model, 0.0))

    def distances(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """(P,) m, of all pairs at q; of hulls negative where they overlap."""
        pin.forwardKinematics(self.robot.model, self.data, q)
        poses = [coal.Transform3s(at.rotation, at.translation) for at in self.data.oMi]
        asked, found = coal.DistanceRequest(True), []
        for pair in self.bodies.pairs:
            shapes = product(self.shapes[pair.first], self.shapes[pair.second])
            found.append(min(
                coal.distance(a, poses[i], b, poses[k], asked, coal.DistanceResult()) - r - s
                for (i, a, r), (k, b, s) in shapes
            ))  # fmt: skip
        return np.array(found)


def needed(bodies):
    """(P,) m, the clearance of each pair, and what triangles may be off."""
    extra = {soup.owner: soup.deviation for soup in bodies.soups}
    return np.array([pair.clearance + extra.get(pair.second, 0.0) for pair in bodies.pairs])


def among_walls(rng, kinds):
    """An arm of made-up joints and bodies among triangles."""
    robot, n = serial_arm(rng, kinds), len(kinds)
    walls = rng.normal(size=(8, 1, 3)) * 0.5 + rng.normal(size=(8, 3, 3)) * 0.2
    pairs = (*all_pairs(n + 1, 0.01), *(Pair(f"b{k}", "wall", 0.0) for k in range(1, n + 1)))
    return robot, of_polytopes(hulls(rng, n), pairs, Soup("wall", walls, 0.002, False))


def among_boxes(rng, name):
    """A known arm with its own shapes among boxes and a dome."""
    turn = [tuple(rng.uniform(-180.0, 180.0, 3)) for _ in range(4)]
    boxes = [(tuple(rng.uniform(0.01, 0.4, 3)), tuple(rng.uniform(-0.8, 0.8, 3))) for _ in turn]
    scene = tuple(Obstacle.box(f"box{k}", *box, turn[k]) for k, box in enumerate(boxes))
    robot, dome = load_robot(name), sphere(0.3, (0, 70), (0, 300), position=(0.6, 0.0, 0.1))
    return robot, gather(robot, dome, Collision(clearance=0.005, scene=scene), 0.02)


@pytest.mark.parametrize("kinds", ["RRRR", "RPRR", "PPRRR"])
def test_bounds_are_what_coal_measures(kinds):
    """Never more; and less by no more than rounding where bodies are apart. Of triangles too."""
    rng, apart = np.random.default_rng(7), 0
    for k in range(4):
        robot = serial_arm(rng, kinds)
        if k % 2:
            bodies = of_polytopes(hulls(rng, robot.n), all_pairs(robot.n + 1, 0.0))
        else:
            robot, bodies = among_walls(rng, kinds)
        clearance, scene = Clearance(robot, bodies), CoalScene(robot, bodies)
        for q in rng.uniform(-2.0, 2.0, (30, robot.n)):
            bounds, truth = clearance.bounds(q), scene.distances(q)
            clear = truth > 1e-6
            assert (bounds[clear] <= truth[clear] + 2e-6).all()
            assert (bounds[clear] >= truth[clear] - 2e-6).all()
            assert (bounds[~clear] <= 1e-9).all()
            apart += int(clear.sum())
    assert apart > 400


MADE_UP = [("RRRR", 0), ("RPRR", 0), ("PRPR", 0)]
ATTACKS = [("ur5", 0), *((name, seed) for name in ("ur5", "panda", "RRRRR", "RPRRR", "PRPRR")
                         for seed in range(1000, 1040))]  # fmt: skip


@sampled(("name", "seed"), [*MADE_UP, *spread(ATTACKS, 1)])
def test_no_segment_with_a_collision_is_called_clear(name, seed):
    """Walks of made-up arms among triangles, of others among boxes: steps of 1e-3 to 0.5."""
    rng, clear, refused, collides = np.random.default_rng([11, seed]), 0, 0, 0
    made = among_walls if set(name) <= {"R", "P"} else among_boxes
    for size in np.repeat([1e-3, 0.02, 0.1, 0.5], 5 if made is among_walls else 1):
        robot, bodies = made(rng, name)
        clearance, scene, needs = Clearance(robot, bodies), CoalScene(robot, bodies), needed(bodies)
        q = rng.uniform(np.maximum(robot.lower, -2.0), np.minimum(robot.upper, 2.0))
        for _ in range(3):
            end = q + rng.uniform(-1.0, 1.0, robot.n) * size
            margin = clearance.margin(q, end)
            count = min(int(np.abs(end - q).max() / FINE) + 2, 8 if seed == 0 else 300)
            rows = q + np.linspace(0.0, 1.0, count)[:, None] * (end - q)
            least = min((scene.distances(each) - needs).min() for each in rows)
            if margin > 0.0:
                assert least >= -1e-9
                assert margin <= (scene.distances(end) - needs).min() + 1e-7
                clear, q = clear + 1, end
            else:
                assert 0 <= clearance.blamed() < len(needs)
                refused, collides = refused + 1, collides + (least < 0.0)
    if (name, seed) in MADE_UP:
        assert clear > 8
        assert collides > 8
        assert refused - collides <= 0.1 * (clear + refused)


def stick(owner, joint):
    """A link of the planar arm."""
    return Polytope(owner, joint, np.array([[0.0, 0.0, 0.0], [LENGTH, 0.0, 0.0]]), RADIUS)


def one_pair(*bodies, clearance=0.0, soup=None):
    """The clearance of a planar arm of one link from the other body."""
    other = bodies[1].owner if soup is None else soup.owner
    pairs = (Pair(bodies[0].owner, other, clearance),)
    everything = of_polytopes(list(bodies), pairs, *([] if soup is None else [soup]))
    return Clearance(planar_arm(1), everything)


def wall_and_stick(kind):
    """A wall 1 mm thick, and a stick on a turning joint that passes through it at 0.5 rad."""
    turned = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    flat = np.array([[0.2, -5e-4], [1.0, -5e-4], [1.0, 5e-4], [0.2, 5e-4]]) @ turned.T
    wall = np.array([[x, y, z] for x, y in flat for z in (-0.1, 0.1)])
    thin = np.array([[x, y, z] for x in (0.1, 0.5) for y in (-0.01, 0.01) for z in (-0.01, 0.01)])
    if kind == "hull":
        return one_pair(Polytope("stick", 1, thin, 0.0), Polytope("wall", 0, wall, 0.0))
    corners = wall[[0, 2, 1, 3]]  # one face of it
    soup = Soup("wall", np.array([corners[:3], corners[1:]]), 0.0, False)
    return one_pair(Polytope("stick", 1, thin, 0.0), soup=soup)


@pytest.mark.parametrize("kind", ["hull", "triangles"])
def test_a_thin_wall_is_never_jumped(kind):
    clearance = wall_and_stick(kind)
    for a in np.linspace(-2.0, 0.3, 12):
        assert clearance.clear(a, a)
        for b in np.linspace(0.7, 2.0, 12):
            assert clearance.clear(b, b)
            assert not clearance.clear(a, b)
            assert not clearance.clear(b, a)
    for a in np.linspace(-2.0, 0.2, 10):
        assert clearance.clear(a, a + 0.2)


def test_no_number_is_never_clear():
    clearance = wall_and_stick("hull")
    for bad in (np.nan, np.inf, -np.inf):
        assert not clearance.clear(bad, bad)
        assert not clearance.clear(-1.0, bad)
        assert not clearance.clear(bad, -1.0)
        assert clearance.clear(-1.0, -1.0)


def test_what_is_inside_a_closed_body_collides():
    """Nothing touches its triangles; of an open body that is all there is to say."""
    ball = np.array(trimesh.creation.icosphere(2, radius=1.0).triangles)
    for closed in (True, False):
        clearance = one_pair(stick("l1", 1), soup=Soup("ball", ball, 0.0, closed))
        for q in np.linspace(-2.0, 2.0, 9):
            assert clearance.clear(q, q) is not closed
            assert bool(clearance.bounds(q)[0] < -0.5) is closed
        aside = Soup("ball", ball + np.array([3.0, 0.0, 0.0]), 0.0, closed)
        assert one_pair(stick("l1", 1), soup=aside).clear(0.0, 0.0)


def test_no_point_moves_further_nor_leaves_its_chord_further_than_bounded():
    """M and delta of every group, seen from every joint before it, against 20 samples."""
    rng, used = np.random.default_rng(2), {"M": 0.0, "delta": 0.0}
    for kinds in ("RRRR", "RPRR", "PRPR"):
        robot = serial_arm(rng, kinds)
        bodies = of_polytopes(hulls(rng, 4), all_pairs(5, 0.0))
        buffer = Clearance(robot, bodies).buffer
        tables = views(buffer)
        for size in np.repeat([1e-3, 0.03, 0.5], 3):
            q0 = rng.uniform(-2.0, 2.0, 4)
            q1 = q0 + rng.uniform(-1.0, 1.0, 4) * size
            tables.configurations[:2] = q0, q1
            for slot in (0, 1):
                place_bodies(buffer, np.int64(slot))
            for body in (body for body in bodies.polytopes if body.joint):
                group = row(buffer, GROUPS, np.int64(body.joint))
                place_group(buffer, group, np.int64(0), np.int64(1))
                for inner in range(body.joint):
                    ends = (np.int64(inner), np.int64(0), np.int64(1))
                    bounds = tables.reach[body.joint, inner], chord_deviation(buffer, group, *ends)
                    found = _moved(robot, body, inner, q0, q1)
                    for name, bound, truth in zip(used, bounds, found, strict=True):
                        assert truth <= bound + 1e-12
                        used[name] = max(used[name], truth / max(bound, 1e-15))
    assert used["M"] > 0.8
    assert used["delta"] > 0.5


def _moved(robot, body, inner, q0, q1):
    """How far vertices move, seen from a joint, and how far they leave their chords."""
    s, q = between(q0, q1, 20)
    track, s = seen(robot, q, inner, body.joint, body.vertices), s[:, None, None]
    chord = (1.0 - s) * track[0] + s * track[-1]
    length = np.linalg.norm(np.diff(track, axis=0), axis=2).sum(axis=0)
    return length.max(), np.linalg.norm(track - chord, axis=2).max()
