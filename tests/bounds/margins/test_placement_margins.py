"""Placement margins: parts displaced as far as is claimed, and solved by the referee's kinematics.

Of random feasible cases the part is displaced on the boundary of the triangle, at random places of
the motion. The claimed configuration, by Newton's method along P(t), has to be inside the ball, the
limits, the cone, the range of the roll, and clear by python-fcl.
"""

from __future__ import annotations

from collections import Counter
from copy import copy
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import plain
import pytest
import referee
import samples
from arm_urdfs import SIX, joint
from asked import question
from bounds import holds
from random_arms import planar_arm, robot_of
from samples import sampled, seeds

from coverable import (
    Axis,
    Collision,
    Obstacle,
    Search,
    Task,
    check,
    cone,
    cylinder,
    ellipsoid,
    hyperboloid,
    load_robot,
    mesh,
    plane,
    poses,
    replay,
    revolution,
    sphere,
    torus,
    verify,
)
from coverable.errors import ArgumentError
from feasibility.certification import displaced_bodies, placement_margin, surface_replay
from feasibility.certification import displacement_balls as lemma
from feasibility.collisions.asked_bodies import gather
from feasibility.task import PlacementError
from feasibility.verdict import Bound, Walk
from surfaces.meshes.triangle_mesh import TriangleMesh

ARMS = ("ur5", "puma560", "panda", "kinova", "xarm7", "z1", "on a rail", "over a turntable")
OUT = {"side": "outside"}
KINDS = {
    "plane": plane((-0.08, 0.08), (-0.06, 0.06), **OUT),
    "sphere": sphere(0.4, (78, 102), (-12, 12), **OUT),
    "cylinder": cylinder(0.3, (-15, 15), (-0.07, 0.07), **OUT),
    "hyperboloid": hyperboloid(0.3, 0.4, (-15, 15), (-0.07, 0.07), **OUT),
    "cone": cone(0.3, 0.3, (-15, 15), (-0.07, 0.07), **OUT),
    "torus": torus(0.4, 0.2, (-12, 12), (-20, 20), **OUT),
    "ellipsoid": ellipsoid((0.3, 0.4, 0.5), (75, 105), (-15, 15), **OUT),
    "revolution": revolution([(0.3, -0.1), (0.35, 0.0), (0.3, 0.1)], (-15, 15), **OUT),
    "mesh": None, "poses": None,
}  # fmt: skip
DISPLACED = 200
USED = Counter()
"""The largest share of each bound that a displacement needed."""


def corners():
    """A bent sheet of triangles about the origin, looking along +x."""
    y, z = (part.ravel() for part in np.meshgrid(*2 * [np.linspace(-0.07, 0.07, 6)], indexing="ij"))
    k = np.arange(30)[np.arange(30) % 6 < 5]
    faces = np.vstack([np.stack([k, k + 6, k + 7], 1), np.stack([k, k + 7, k + 1], 1)])
    return TriangleMesh(np.stack([-0.5 * (y**2 + 0.4 * z**2), y, z], 1), faces)


def cells_at(kind, rotation, shift):
    """About 2 x 3 cells of a specimen, whose middle would look along +x, moved rigidly."""
    if kind == "poses":
        way = np.linspace(-0.08, 0.08, 5)
        points = np.stack([-0.4 * way**2, way, 0.05 * np.sin(20 * way)], 1)
        normals = referee.unit(np.stack([1 + 0 * way, 0.8 * way, 0 * way], 1))
        return poses(points @ rotation.T + shift, normals @ rotation.T)
    if kind == "mesh":
        return mesh(corners(), **OUT).moved(rotation, shift).cells(count=5)
    return KINDS[kind].moved(rotation, shift).cells(2, 3)


def arm_named(name):
    if name == "on a rail":
        return load_robot("ur5", axes=[Axis("rail", "prismatic", (0, 1, 0), limits=(-0.6, 0.6))])
    if name == "over a turntable":
        table = Axis("table", "revolute", (0, 0, 1), carries="surface", limits=(-2.0, 2.0))
        return load_robot("ur5", axes=[table])
    return load_robot(name, **({"limits": "set-1"} if name == "puma560" else {}))


@cache
def case_of(seed):
    """A random feasible case: its kind, how to place its cells, and its verdict."""
    rng, name = np.random.default_rng(seed), ARMS[seed % len(ARMS)]
    kind, robot = list(KINDS)[seed // 3 % len(KINDS)], arm_named(name)
    arm = plain.arm_of(robot)
    low, high = (np.clip(end, -2.5, 2.5) for end in (robot.lower, robot.upper))
    for _ in range(60):
        q = low + (high - low) * rng.uniform(0.2, 0.8, robot.n)
        (point,), (axis,), (x,) = arm.tool(q)
        if np.linalg.svd(derivative(arm, q[None])[0])[1][-1] < 0.12:
            continue
        home = cells_at(kind, np.eye(3), np.zeros(3))
        middle = int(np.linalg.norm(home.centres - home.centres.mean(0), axis=1).argmin())
        normal, standoff = home.normals[middle], float(rng.uniform(0.01, 0.04))
        turn = onto(normal, -axis, rng)
        place = turn, point + standoff * axis - turn @ home.centres[middle]
        cone, roll, collision = float(rng.uniform(8, 40)), None, None
        if seed % 6 == 0:
            roll, wide = "roll", float(rng.uniform(20, 60))
            along = turn @ np.linalg.svd(normal[None])[2][1]
            psi = np.degrees(referee.roll_about(x[None], axis[None], along[None], axis[None])[0])
            roll = {"roll_deg": (psi - wide, psi + wide),
                    "roll_reference": tuple(np.linalg.svd(normal[None])[2][1])}  # fmt: skip
        if seed % 3 == 1:
            beside = point + 0.25 * referee.unit(np.cross(axis, rng.normal(size=3)))
            box = Obstacle.box("box", (0.04, 0.05, 0.06), tuple(beside))
            frame = {"surface": bool(seed % 2)}
            collision = Collision(
                clearance=0.002, scene=() if robot.surface_link else (box,), **frame
            )
        task = Task(standoff, cone, collision=collision, **(roll or {}))
        try:
            cells = cells_at(kind, *place)
            verdict = check(robot, cells, task, Search(evaluations=40_000))
        except ArgumentError:  # a reference along the approach
            continue
        if verdict.feasible:
            return SimpleNamespace(kind=kind, place=place, verdict=verdict, arm=arm)
    raise AssertionError("no feasible case was found")


def onto(start, end, rng):
    """A random rotation (3, 3) of one unit vector onto another."""
    one, other = (
        np.linalg.qr(np.column_stack([v, rng.normal(size=(3, 2))]))[0] for v in (start, end)
    )
    for frame, v in ((one, start), (other, end)):
        frame[:, 0] = v
        frame[:, 2] = np.cross(frame[:, 0], frame[:, 1])
    return other @ one.T


def derivative(arm, q, which=0):
    """(k, 3, n) of tool points, or axes, by central differences."""
    steps = 1e-6 * np.vstack([np.eye(q.shape[1]), -np.eye(q.shape[1])])
    there = arm.tool((q[:, None] + steps).reshape(-1, q.shape[1]))[which]
    ahead, back = np.split(there.reshape(len(q), -1, 3), 2, axis=1)
    return (ahead - back).transpose(0, 2, 1) / 2e-6


def turns(vectors):
    """(k, 3, 3) rotations about vectors (k, 3), by their lengths."""
    angles = np.linalg.norm(vectors, axis=1)
    axes = vectors / np.maximum(angles, 1e-300)[:, None]
    return np.stack([referee.about(a, np.array([t]))[0] for a, t in zip(axes, angles, strict=True)])


def margin_and_balls(robot, cells, task, walk):
    """The margin of a motion, and the bounds along it that it is made of."""
    asked, real = [], surface_replay.margin_of
    surface_replay.margin_of = lambda *given: asked.append(given) or real(*given)
    try:
        found = replay(robot, cells, task, walk, np.ones(len(cells), dtype=bool))
    finally:
        surface_replay.margin_of = real
    assert found.accepted, found.refusal
    *_, q, room = asked[0]
    case = lemma.Given(robot, task, cells.centres.mean(axis=0))
    balls = lemma.Balls.join(*lemma.balls_along(case, q, room))
    return found.certificate.placement_margin, balls


class Displaced:
    """Displacements on the boundary of the triangle, and where the claim says that the arm is."""

    def __init__(self, arm, cells, walk, margin, balls, rng, count):
        rows, pivot = walk.q, np.array(margin.pivot)
        np.testing.assert_allclose(pivot, cells.centres.mean(axis=0), atol=1e-12)
        share = np.where(rng.random(count) < 0.6, rng.integers(0, 2, count), rng.random(count))
        direct = [referee.unit(rng.normal(size=(count, 3))) for _ in range(2)]
        self.turn = turns(share[:, None] * margin.angle * direct[0])
        self.shift = (1.0 - share)[:, None] * margin.position * direct[1]
        self.theta = share * margin.angle
        weak = np.argsort(balls.positions)[
            np.minimum(rng.exponential(4, count), len(balls.row) - 1).astype(int)
        ]
        self.at = at = np.where(
            rng.random(count) < 0.5, weak, rng.integers(0, len(balls.row), count)
        )
        row, (low, high) = balls.row[at], balls.share[at].T
        self.row, self.time = row, low + rng.random(count) * (high - low)
        if cells.surface.kind == "poses":  # directions between poses are not known here
            marked = np.flatnonzero(walk.cell[:-1] >= 0)
            on = marked[rng.integers(0, len(marked), count)]
            self.at = at = np.array(
                [np.flatnonzero((balls.row == k) & (balls.share[:, 0] == 0))[0] for k in on]
            )
            row, (low, high) = on, balls.share[at].T
            self.row, self.time = row, low
        self.balls = balls.of(at)

        def between(share):
            return rows[row] + share[:, None] * (rows[row + 1] - rows[row])

        ends = [np.linalg.pinv(derivative(arm, between(share))) for share in (low, high)]
        part = ((self.time - low) / (high - low))[:, None, None]
        inverse = (1.0 - part) * ends[0] + part * ends[1]
        self.nominal = between(self.time)
        self.points, self.axes, self.x = arm.tool(self.nominal)
        target = pivot + (self.turn @ (self.points - pivot)[..., None])[..., 0] + self.shift
        self.rho = np.linalg.norm(target - self.points, axis=1)
        v = np.zeros((count, 3))
        for _ in range(25):
            self.q = self.nominal + (inverse @ v[..., None])[..., 0]
            missed = target - arm.tool(self.q)[0]
            if np.abs(missed).max() < 1e-11:
                break
            v += np.linalg.solve(derivative(arm, self.q) @ inverse, missed[..., None])[..., 0]
        assert np.abs(missed).max() < 1e-9, "no solution was found"
        self.v = np.linalg.norm(v, axis=1)
        self.pivot = pivot

    def back(self, arm):
        """The arm's tool as the part that is displaced sees it."""
        points, axes, x = arm.tool(self.q)
        inverse = self.turn.transpose(0, 2, 1)
        points = self.pivot + (inverse @ (points - self.pivot - self.shift)[..., None])[..., 0]
        return points, *((inverse @ one[..., None])[..., 0] for one in (axes, x))


def use(name, truth, bound):
    """Is the bound kept? How much of it was needed is noted."""
    assert (truth <= bound * (1 + 1e-6) + 1e-9).all(), (
        f"{name}: {np.max(truth - bound):.3g} too much"
    )
    some = bound > 1e-6
    USED[name] = max(USED[name], float((truth[some] / bound[some]).max(initial=0.0)))


def attack(arm, robot, cells, task, walk, rng, count):
    """Displace, solve and judge; the margin."""
    margin, balls = margin_and_balls(robot, cells, task, walk)
    if margin.position == 0.0 and margin.angle == 0.0:
        return margin
    here = Displaced(arm, cells, walk, margin, balls, rng, count)
    ball, root = here.balls, np.maximum(here.balls.slope**2 - 2 * here.balls.second * here.rho, 0)
    y = 2 * here.rho / (ball.slope + np.sqrt(root))
    use("ball", here.v, y)
    use("joints", np.abs(here.q - here.nominal), ball.moves * y[:, None])
    assert np.clip(here.q, robot.lower, robot.upper).tolist() == here.q.tolist()
    _, axes, _ = arm.tool(here.q)
    use(
        "tilt",
        np.linalg.norm(axes - here.axes, axis=1),
        ball.tilts[:, 0] * y + 0.5 * ball.tilts[:, 1] * y**2,
    )
    if task.min_manipulability is not None:
        least = singular(robot, arm, here.q)
        assert (least >= task.min_manipulability - 1e-9).all()
        USED["sigma"] = max(USED["sigma"], task.min_manipulability / least.min())
    points, axes, x = here.back(arm)
    seen = SimpleNamespace(tool=lambda q: (points, axes, x))
    asked, surface = plain.asked_of(task, cells), plain.surface_of(cells.surface)
    if surface is None:
        aims, approaches = plain.targets_of(cells, task)
        cell = walk.cell[here.row]
        assert (np.linalg.norm(points - aims[cell], axis=1) <= asked.tolerance + 1e-9).all()
        assert (referee.angles_between(axes, approaches[cell]) <= asked.cone + 1e-9).all()
    else:
        kept = referee.kept_over(seen, surface, asked, here.q)
        assert (kept.off <= asked.tolerance + 1e-9).all()
        assert (kept.tilt <= asked.cone + 1e-9).all()
        assert (kept.roll <= 1e-9).all()
        before = referee.kept_over(
            SimpleNamespace(tool=lambda q: (here.points, here.axes, here.x)), surface, asked, here.q
        )
        if asked.roll is not None:
            turned = (here.theta + ball.turns * y) / np.cos(0.5 * min(task.cone, 0.5 * np.pi))
            use("roll", np.maximum(kept.roll - before.roll, 0.0), turned)
    scene = plain.scene_of(robot, cells, task)
    if scene is not None and scene.pairs:  # all pairs of a few, and the nearest ones of all
        needed = np.array([pair[2] for pair in scene.pairs])
        spare = np.min([scene.distances(q) - needed for q in here.nominal[:5]], axis=0)
        near = np.flatnonzero((spare < 0.06) | (np.argsort(np.argsort(spare)) < 3))
    for k in range(count if scene is not None and scene.pairs else 0):
        moved = np.eye(4)
        moved[:3, :3], moved[:3, 3] = (
            here.turn[k],
            here.pivot + here.shift[k] - here.turn[k] @ here.pivot,
        )
        with_it = rng.random() < 0.5
        bodies = {
            name: [(one._replace(placement=moved @ one.placement), model)
                   if one.link is None and (name == "surface" or with_it) else (one, model)
                   for one, model in shapes]
            for name, shapes in scene.bodies.items()
        }  # fmt: skip
        seen_by_fcl = copy(scene)
        seen_by_fcl.bodies = bodies
        which = np.arange(len(needed)) if k < 5 else near
        assert (seen_by_fcl.distances(here.q[k], which) >= needed[which] - 1e-6).all()
    return margin


@sampled
@pytest.mark.parametrize("seed", seeds(6, all=300))
def test_a_part_that_stands_as_far_off_as_is_claimed_is_reached(seed):
    """And `check` never calls it infeasible there, with the motion to begin from."""
    made, rng = case_of(seed), np.random.default_rng([seed, 1])
    verdict, arm = made.verdict, made.arm
    robot, cells, task, walk = verdict.robot, verdict.cells, verdict.task, verdict.witness
    margin = attack(arm, robot, cells, task, walk, rng, DISPLACED if samples.EVERYTHING else 40)
    share, direct = rng.random(), [referee.unit(rng.normal(size=3)) for _ in range(2)]
    turn = turns(share * margin.angle * direct[0][None])[0]
    shift = (1.0 - share) * margin.position * direct[1]
    at, pivot = made.place, np.array(margin.pivot)
    there = turn @ at[0], pivot + turn @ (at[1] - pivot) + shift
    again = check(robot, cells_at(made.kind, *there), task, Search(evaluations=40_000), seeds=walk)
    assert again.answer != "infeasible"


@pytest.mark.skipif(
    not samples.EVERYTHING, reason="of the few cases in make test some bounds are never met"
)
def test_the_bounds_are_needed():
    assert min(USED[name] for name in ("ball", "joints", "tilt")) >= 0.9, USED


# -- the bounds of stretches, one by one ----------------------------------------------------------


NEEDED = {"kappa": 0.5, "second": 0.98, "first": 0.99, "bend": 0.98, "far": 0.99, "sigma": 0.01}
"""The least share of each bound that some sample has to need."""


def twice(levers, steps, slides):
    """(k,) the lemma's sum, term by term: joints turn what is behind them."""
    pairs = ((i, j) for j in range(len(steps)) for i in range(j + 1) if not slides[i])
    return sum((1 + (i < j)) * levers[:, j] * steps[i] * steps[j] for i, j in pairs)


@sampled
@pytest.mark.parametrize("seed", seeds(1, all=40))
@pytest.mark.parametrize("name", [*SIX, "on a rail"])
def test_bounds_along_stretches(name, seed):
    """Against dense samples, of motions with steps of up to 20 deg, and balls of up to 5 cm."""
    robot, rng = arm_named(name), np.random.default_rng(seed)
    arm, low, high = plain.arm_of(robot), robot.lower.clip(-2.0), robot.upper.clip(max=2.0)
    found, one = {what: ([], []) for what in NEEDED}, np.array([0])

    def note(what, bound, truth):
        for kept, each in zip(found[what], np.broadcast_arrays(bound, truth), strict=True):
            kept.append(each.ravel())

    for _ in range(40):
        start = low + (high - low) * rng.random(robot.n)
        way = 0.35 * rng.random() ** 3 * referee.unit(rng.normal(size=robot.n))
        q, size = np.stack([start, start + way]), np.array([rng.uniform(0.0, 0.05)])
        least = singular(robot, arm, q).min()
        case = lemma.Given(robot, Task(0.0, 30.0, min_manipulability=0.9 * least), np.ones(3))
        ends, whole = lemma.ends_of(case, q), np.array([[0.0, 1.0]])
        s = lemma.Parts(one, whole, ends.of(one), ends.of(one + 1), np.full((1, 2), 9.0))
        ball = lemma.balls_of(case, s, size, size)
        if not ball.slope > 0.2:
            continue
        share = np.linspace(0.0, 1.0, 9)[:, None, None]
        inverse = np.stack([np.linalg.pinv(each) for each in derivative(arm, q)])
        norm, d = (
            np.linalg.norm(inverse, 2, axis=(1, 2)).max(),
            np.linalg.norm(inverse, axis=2).max(0),
        )
        np.testing.assert_allclose(ball.moves[0], d, rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(ball.turns, d[~robot.prismatic].sum(), rtol=1e-5)
        mean = (1.0 - share) * inverse[0] + share * inverse[1]
        rows = q[0] + share[:, :, 0] * way
        v = referee.unit(rng.normal(size=(9, 3)))[..., None]
        there = rows + (mean @ (size * v))[..., 0]
        for which, (whole, second) in enumerate((("kappa", "second"), ("first", "bend"))):
            along, off = derivative(arm, rows, which), derivative(arm, there, which)
            change = 0.5 * norm * np.linalg.norm(along[0] - along[-1], 2)
            if whole == "kappa":
                note(
                    whole,
                    1.0 - ball.slope,
                    np.linalg.norm(along @ mean - np.eye(3), 2, axis=(1, 2)),
                )
                note(whole, 1.0 - ball.slope, change)
            else:
                note(whole, ball.tilts[:, 0], np.linalg.norm(along @ mean, 2, axis=(1, 2)))
                most = np.linalg.norm(along[[0, -1]] @ inverse, 2, axis=(1, 2)).max()
                note(whole, ball.tilts[:, 0], most + change)
            bound = ball.tilts[:, 1] if which else ball.second
            levers = np.linalg.norm(off, axis=1)
            note(second, bound, twice(levers, d, robot.prismatic))
            u = 1e-4 * referee.unit(rng.normal(size=(9, 3)))[..., None]
            back, here, ahead = (
                arm.tool(there + (h * mean @ u)[..., 0])[which] for h in (-1, 0, 1)
            )
            note(second, bound, np.linalg.norm(back - 2.0 * here + ahead, axis=1) / 1e-8)
        note("far", ball.far, np.linalg.norm(arm.tool(rows)[0] - np.ones(3), axis=1))
        if ball.caps[0, 1] > 0.0:
            after = singular(robot, arm, rows + (mean @ (ball.caps[0, 1] * v))[..., 0])
            note("sigma", 0.1 * least, least - after)
    for what, (bound, truth) in found.items():
        holds(np.concatenate(bound), np.concatenate(truth), NEEDED[what], tiny=1e-6)


def singular(robot, arm, q):
    """(k,) the smallest singular value that counts, of tool point over reach and axis."""
    both = [derivative(arm, q, which) for which in (0, 1)]
    return np.linalg.svd(np.concatenate([both[0] / robot.length_unit, both[1]], axis=1))[1][:, 4]


def test_what_a_ball_allows_is_solved_for():
    """Limits, cone and roll with the part turned; what is reached, and how far joints move."""
    rng, k = np.random.default_rng(2), 50
    tilts, caps = rng.uniform(0.1, 3.0, (k, 2)), rng.uniform(0.01, 0.3, (k, 2))
    room, slope, second, turns = rng.uniform(0.05, 1.0, (k, 2)), *rng.uniform(0.5, 0.9, (3, k))
    moves, far = rng.uniform(0.0, 2.0, (k, 6)), rng.uniform(0.1, 1.0, k)
    ball = lemma.Balls(np.arange(k), room, slope, second, tilts, moves, turns, caps, room, far)
    theta = 0.04 * rng.random(k)
    limit, cone, roll, other = ball.allowed(theta).T
    np.testing.assert_array_equal([limit, other], caps.T)
    chord = tilts[:, 0] * cone + 0.5 * tilts[:, 1] * cone**2
    np.testing.assert_allclose(2.0 * np.arcsin(0.5 * chord) + theta, room[:, 0])
    np.testing.assert_allclose(turns * roll + theta, room[:, 1])
    assert (ball.allowed(np.full(k, 1.01))[:, 1:3] < 0.0).all()
    y = np.minimum.reduce([limit, cone, roll, other])
    np.testing.assert_allclose(ball.reached(theta), slope * y - 0.5 * second * y**2)
    theta = ball.angles
    np.testing.assert_allclose(ball.reached(theta), theta * far, atol=1e-9)
    small = 0.5 * min(ball.positions.min(), 0.01)
    y = ball.moved(small, 0.0) / moves
    np.testing.assert_allclose(slope[:, None] * y - 0.5 * second[:, None] * y**2, small)
    assert (
        ball.moved(small, small) >= np.maximum(ball.moved(small, 0.0), ball.moved(0.0, small))
    ).all()


# -- by hand --------------------------------------------------------------------------------------


def slides(limits=((-1.0, 1.0),) * 3):
    """Three slides along x, y and z, with a tool that looks down."""
    made = [joint(k + 1, "prismatic", axis=np.eye(3)[k], limits=limits[k]) for k in range(3)]
    return replace(robot_of(made, (0.0, 0.0, -1.0)), reference_axis=np.array([1.0, 0.0, 0.0]))


PLATE = plane((-0.04, 0.04), (-0.03, 0.03), "outside").cells(2, 2)
HALF = np.hypot(0.02, 0.015)  # m, from the middle to every target


def margin_of_slides(robot, **task):
    task = Task(0.0, **{"cone_deg": 30.0, **task})
    q = PLATE.centres[[0, 1, 3, 2]]
    found = replay(robot, PLATE, task, Walk(q, np.array([0, 1, 3, 2])), np.ones(4, dtype=bool))
    assert found.accepted, found.refusal
    return found.certificate.placement_margin


def test_slides_follow_as_far_as_they_reach():
    """Each moves as far as the part at most, the tool never tilts, and rolls as the part turns."""
    free = margin_of_slides(slides())
    assert free.position == pytest.approx(0.98, rel=1e-6)
    assert free.angle == pytest.approx(np.radians(30.0), rel=1e-6)
    assert (free.bound_by, free.what) == (Bound.LIMIT, "j1")
    np.testing.assert_allclose(free.pivot, 0.0, atol=1e-12)
    for limits in (((-1, 1), (-1, 1), (-0.004, 1)), ((-1, 1), (-1, 1), (-1, 0.004))):
        near = margin_of_slides(slides(limits))
        assert near.position == pytest.approx(0.004, rel=1e-6)
        assert 0.95 * 0.004 / HALF <= near.angle <= 0.004 / HALF
        assert (near.bound_by, near.what) == (Bound.LIMIT, "j3")
    narrow = margin_of_slides(slides(), cone_deg=5.0)
    assert narrow.angle == pytest.approx(np.radians(5.0), rel=1e-6)
    assert narrow.position == pytest.approx(0.98, rel=1e-6)
    rolled = margin_of_slides(slides(), cone_deg=10.0, roll_deg=(-20.0, 4.0))
    assert rolled.angle == pytest.approx(np.radians(4.0) * np.cos(np.radians(5.0)), rel=1e-6)
    assert rolled.position == pytest.approx(0.98, rel=1e-6)


def test_there_is_none_without_a_way_to_follow():
    """A planar arm follows nothing out of its plane; a motion with a start begins there."""
    robot = planar_arm()
    q = np.array([[0.5, 0.6, 0.7], [0.52, 0.58, 0.72]])
    tips = plain.tools(robot, q)[0]
    line = poses(tips, -plain.tools(robot, q)[1], neighbours="order")
    walk = Walk(q, np.array([0, 1]))
    found = replay(robot, line, Task(0.0, 30.0), walk, np.ones(2, dtype=bool))
    margin = found.certificate.placement_margin
    assert (margin.position, margin.angle, margin.bound_by) == (0.0, 0.0, Bound.SINGULAR)
    begun = replace(slides(), start=PLATE.centres[0])
    margin = margin_of_slides(begun)
    assert (margin.position, margin.angle, margin.bound_by) == (0.0, 0.0, Bound.START)


@pytest.mark.parametrize("name", ["plate", "small dome"])
def test_what_is_asked_for_is_found_or_said_to_be_missing(name):
    robot, cells, task = question(name)[2:5]
    task = replace(task, cone_deg=5.0)
    asked_for = PlacementError(0.006, 0.2)
    nominal = check(robot, cells, task).certificate.placement_margin
    verdict = check(robot, cells, replace(task, placement_error=asked_for))
    assert verdict.feasible
    margin = verdict.certificate.placement_margin
    assert nominal.share(asked_for) > 1.0 >= margin.share(asked_for)
    assert margin.share(asked_for) == pytest.approx(
        0.006 / margin.position + np.radians(0.2) / margin.angle
    )
    assert verify(verdict).holds
    too_much = replace(task, placement_error=(0.4, 0.0))
    assert check(robot, cells, too_much).answer == "undecided"
    refusal = verify(robot, cells, too_much, verdict.witness.q).refusal
    assert "400 mm" in refusal
    assert str(margin) in refusal
    away = replace(robot, lower=robot.lower * 0.01, upper=robot.upper * 0.01)
    assert check(away, cells, too_much).answer == "infeasible"


def test_the_singular_value_is_kept():
    robot, cells, task = question("plate")[2:5]
    verdict, rng = check(robot, cells, task), np.random.default_rng(5)
    free = verdict.certificate.placement_margin
    walk, arm = verdict.witness, plain.arm_of(robot)
    sigma = check(robot, cells, replace(task, min_manipulability=1e-3)).certificate
    asked = replace(task, min_manipulability=0.98 * sigma.min_singular_value)
    margin = attack(arm, robot, cells, asked, walk, rng, 300)
    assert 0.0 < margin.position < 0.5 * free.position
    assert margin.bound_by is Bound.SINGULAR


def test_bodies_are_asked_again_with_what_the_displacement_needs(monkeypatch):
    """Clearances are raised by what a point of the part moves, or of the tool as it turns."""
    robot, cells, task = question("plate")[2:5]
    scene = (Obstacle.box("box", (0.1, 0.1, 0.1), (0.5, 0.5, 0.8)),
             Obstacle.halfspace("floor", (0, 0, -0.5)))  # fmt: skip
    task = replace(task, collision=Collision(clearance=0.001, scene=scene))
    asked, real = [], displaced_bodies.collision_replay
    monkeypatch.setattr(
        displaced_bodies, "collision_replay", lambda *given: asked.append(given) or real(*given)
    )
    verdict = check(robot, cells, task)
    margin = verdict.certificate.placement_margin
    assert margin.position > 0.0
    bodies, pivot = (
        gather(robot, cells.surface, task.collision, task.standoff),
        np.array(margin.pivot),
    )
    before = {(pair.first, pair.second): pair.clearance for pair in bodies.pairs}
    found, balls = margin_and_balls(robot, cells, replace(task, collision=None), verdict.witness)
    share, (_, raised, q, moved) = displaced_bodies.SHARES[0], asked[0]
    shift, turn = share * found.position, share * found.angle
    for row in range(len(q) - 1):
        most = balls.of(balls.row == row).moved(shift, turn).max(axis=0)
        np.testing.assert_allclose(moved[row], most)
    rng, more = np.random.default_rng(4), {}
    for pair in raised.pairs:
        more.setdefault(pair.second, set()).add(pair.clearance - before[pair.first, pair.second])
    sheet = max((soup for soup in bodies.soups), key=lambda soup: soup.owner == "surface")
    corners = scene[0].placement[:3, 3] + np.array(list(np.ndindex(2, 2, 2))) * 0.1 - 0.05
    for name, points in (("surface", sheet.triangles.reshape(-1, 3)), ("box", corners)):
        (raise_,) = more.pop(name)
        arms = points[np.linalg.norm(points - pivot, axis=1).argmax()] - pivot
        across = referee.unit(np.cross(arms, rng.normal(size=(50, 3))))
        turned = np.linalg.norm((turns(turn * across) @ arms) - arms, axis=1)
        holds(raise_, np.append(turned, shift), 0.99)
    (raise_,) = more.pop("floor")
    tips = plain.arm_of(robot).tool(q)[0]
    assert raise_ >= turn * np.linalg.norm(tips - pivot, axis=1).max()
    assert {value for values in more.values() for value in values} == {0.0}
    _, at_tool, _ = asked[1]
    assert {pair.second for pair in at_tool.pairs} == {"surface"}
    assert {(p.first, p.second) for p in (*raised.pairs, *at_tool.pairs)} == set(before)
    turned = turn + moved.sum(axis=1).max()
    for pair in at_tool.pairs:
        bodies_of = [b for b in bodies.polytopes if b.owner == pair.first]
        tool = robot.model.frames[robot.tool_frame_id].placement.translation
        reach = max(np.linalg.norm(b.vertices - tool, axis=1).max() + b.radius for b in bodies_of)
        assert pair.clearance - before[pair.first, pair.second] == pytest.approx(turned * reach)


def test_the_last_row_counts_for_the_last_segment():
    """And a cell's own approach direction where its target is passed."""
    q, room = PLATE.centres[[0, 1, 3, 2]], np.full((4, 2), 0.5)
    room[3, 0] = 0.01
    margin = placement_margin.placement_margin(slides(), PLATE, Task(0.0, 30.0), q, room)
    assert margin.angle == pytest.approx(0.01, rel=1e-6)
