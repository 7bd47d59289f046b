"""Parts displaced as far as a margin claims, solved by the referee's kinematics.

Displacements are on the boundary of the triangle, any or in the worst direction, at any place of
the motion or where there is least room. The claimed configuration, by Newton's method along P(t),
has to be inside the ball, the limits, the cone, the range of the roll, and clear by python-fcl.
"""

from collections import Counter
from copy import copy
from types import SimpleNamespace

import numpy as np
import plain
import referee
from scipy.spatial.transform import Rotation

from feasibility.certification import placement_margin as lemma
from feasibility.certification.displaced_bodies import Nearer
from feasibility.certification.motion_replay import replay

USED = Counter()
"""The largest share of each bound that a displacement needed."""
NEAR = 0.06  # [m] pairs that are asked of python-fcl at each displacement


def derivative(arm, q, which=0):
    """(k, 3, n) of tool points, or axes, by central differences."""
    steps = 1e-6 * np.vstack([np.eye(q.shape[1]), -np.eye(q.shape[1])])
    there = arm.tool((q[:, None] + steps).reshape(-1, q.shape[1]))[which]
    ahead, back = np.split(there.reshape(len(q), -1, 3), 2, axis=1)
    return (ahead - back).transpose(0, 2, 1) / 2e-6


def singular(robot, arm, q):
    """(k,) the smallest singular value that counts, of tool point over reach and axis."""
    both = [derivative(arm, q, which) for which in (0, 1)]
    return np.linalg.svd(np.concatenate([both[0] / robot.length_unit, both[1]], axis=1))[1][:, 4]


def turned(rotations, vectors):
    """(k, 3) vectors, each by its own rotation (k, 3, 3)."""
    return np.einsum("kij,kj->ki", rotations, vectors)


def placed(frames, joint, points):
    """(k, 3) points on a joint, each in its own one of the frames."""
    return turned(frames.rotations[:, joint], points) + frames.points[:, joint]


def margin_and_balls(robot, cells, task, walk):
    """The margin of a motion, with the bounds that it is made of, and couples of bodies."""
    found = replay(robot, cells, task, walk, np.ones(len(cells), dtype=bool))
    assert found.accepted, found.refusal
    kept, margin = found.certificate.margin, found.certificate.placement_margin
    pivot, (*_, q, room) = cells.centres.mean(axis=0), getattr(kept, "func", kept).__wrapped__.args
    np.testing.assert_allclose(margin.pivot, pivot, atol=1e-12)
    rows, row = lemma.cut(np.vstack([q, q[-1:]]), task)
    balls = lemma.balls_along(lemma.Kinematics(robot), task, pivot, rows, room[row])
    pairings = getattr(kept, "args", ((),))[0]
    return margin, SimpleNamespace(balls=balls, rows=rows, row=row, pairings=pairings)


def displaced(arm, cells, walk, margin, bounds, rng, count):
    """Displacements, and where the claim says that the arm is."""
    pivot, share, balls = np.array(margin.pivot), rng.random(count), bounds.balls
    share = np.where(rng.random(count) < 0.6, np.round(share), share)
    last = len(bounds.row) - 1
    weak = np.argsort(balls.triangle[:, 0])[np.minimum(rng.exponential(4, count), last).astype(int)]
    at, part = np.where(rng.random(count) < 0.5, weak, rng.integers(0, last + 1, count)), None
    if cells.surface.kind == "poses":  # directions between poses are not known here
        begin = np.flatnonzero(np.diff(bounds.row, prepend=-1) & (walk.cell[bounds.row] >= 0))
        at, part = begin[rng.integers(0, len(begin), count)], np.zeros(count)
    part = (rng.random(count) if part is None else part)[:, None]
    low, high = bounds.rows[at], bounds.rows[at + 1]
    one, other = (np.linalg.pinv(derivative(arm, q)) for q in (low, high))
    inverse = (1.0 - part[..., None]) * one + part[..., None] * other
    q = nominal = (1.0 - part) * low + part * high
    points, axes, x = arm.tool(nominal)
    about, along = worst(arm, nominal, axes, inverse, rng)
    turn = Rotation.from_rotvec(share[:, None] * margin.angle * about).as_matrix()
    shift, v = (1.0 - share)[:, None] * margin.position * along, np.zeros((count, 3))
    target = pivot + turned(turn, points - pivot) + shift
    for _ in range(25):
        missed = target - arm.tool(q)[0]
        if np.abs(missed).max() < 1e-11:
            break
        v += np.linalg.solve(derivative(arm, q) @ inverse, missed[..., None])[..., 0]
        q = nominal + turned(inverse, v)
    assert np.abs(missed).max() < 1e-9, "no solution was found"
    found, back = arm.tool(q), turn.transpose(0, 2, 1)
    seen = (pivot + turned(back, found[0] - pivot - shift), *(turned(back, e) for e in found[1:]))
    placement = np.tile(np.eye(4), (count, 1, 1))
    placement[:, :3, :3], placement[:, :3, 3] = turn, pivot + shift - turn @ pivot
    return SimpleNamespace(
        ball=balls.of(at), cell=walk.cell[bounds.row[at]], q=q, nominal=nominal, v=v, tool=found,
        before=(points, axes, x), seen=seen, rho=np.linalg.norm(target - points, axis=1),
        theta=share * margin.angle, placement=placement,
    )  # fmt: skip


def worst(arm, nominal, axes, inverse, rng):
    """(k, 3), (k, 3) axes of turns and directions of shifts: any, or those that need most.

    The approach turns with what is across it, and rolls with what is along it; a joint is moved
    furthest along its row of P, the axis along what A P stretches most.
    """
    k, kind = len(inverse), rng.integers(0, 3, (2, len(inverse), 1))
    free, sign = referee.unit(rng.normal(size=(3, k, 3))), rng.choice([-1.0, 1.0], (k, 1))
    rows = inverse[np.arange(k), rng.integers(0, inverse.shape[1], k)]
    rows = sign * referee.unit(rows + 1e-9 * free[0])
    most = sign * np.linalg.svd(derivative(arm, nominal, 1) @ inverse)[2][:, 0]
    across = referee.unit(np.cross(axes, free[1]))
    return np.choose(kind[0], [free[1], across, axes]), np.choose(kind[1], [free[2], rows, most])


def use(name, truth, bound):
    """Is the bound kept? How much of it was needed is noted."""
    over = np.max(truth - bound * (1 + 1e-6))
    assert over <= 1e-9, f"{name}: {over:.3g} too much"
    some = bound > 1e-6
    USED[name] = max(USED[name], float((truth[some] / bound[some]).max(initial=0.0)))


def attack(arm, robot, cells, task, walk, rng, count):
    """Displace, solve and judge; the margin."""
    margin, along = margin_and_balls(robot, cells, task, walk)
    if margin.position == 0.0 and margin.angle == 0.0:
        return margin
    np.testing.assert_allclose(margin.along.min(), margin.position, rtol=1e-6)
    here = displaced(arm, cells, walk, margin, along, rng, count)
    ball = here.ball
    root = np.sqrt(np.maximum(ball.slope**2 - 2 * ball.second * here.rho, 0))
    y = 2 * here.rho / (ball.slope + root)
    use("ball", np.linalg.norm(here.v, axis=1), y)
    use("joints", np.abs(here.q - here.nominal), ball.moves * y[:, None])
    tilted = referee.angles_between(here.tool[1], here.before[1])
    tilt, roll = (ball.turns @ np.array([y, 0.5 * y**2]).T[..., None])[..., 0].T
    use("tilt", tilted, tilt)
    assert ((here.q >= robot.lower) & (here.q <= robot.upper)).all()
    if task.min_manipulability is not None:
        least, asked = singular(robot, arm, here.q), np.full(count, task.min_manipulability)
        use("sigma", asked, least)
    asked, surface = plain.asked_of(task, cells), plain.surface_of(cells.surface)
    if surface is None:
        aims, approaches = plain.targets_of(cells, task)
        off = np.linalg.norm(here.seen[0] - aims[here.cell], axis=1)
        tilt = referee.angles_between(here.seen[1], approaches[here.cell])
    else:
        kept, before = (
            referee.kept_over(SimpleNamespace(tool=lambda q, e=each: e), surface, asked, here.q)
            for each in (here.seen, here.before)
        )
        off, tilt = kept.off, kept.tilt
        assert (kept.roll <= 1e-9).all()
        if asked.roll is not None:
            rolled = (here.theta + roll) / np.cos(0.5 * min(task.cone, 0.5 * np.pi))
            use("roll", np.maximum(kept.roll - before.roll, 0.0), rolled)
    assert (off <= asked.tolerance + 1e-9).all()
    assert (tilt <= asked.cone + 1e-9).all()
    scene = plain.scene_of(robot, cells, task)
    if scene is not None and scene.pairs:
        stays_clear(scene, here, rng)
    if along.pairings:
        beside = {"surface", *(one.name for one in task.collision.scene)}
        bodies = Nearer(robot, along.pairings, beside, np.array(margin.pivot))
        part = margin.position
        row, moved = along.row.clip(max=len(walk.q) - 2), along.balls.moved(part, margin.angle)
        moved = np.array([moved[row == k].max(axis=0) for k in range(row[-1] + 1)])
        most = bodies.by(moved, part, margin.angle)
        for one, each in zip(along.pairings, most, strict=True):
            assert (one.low - one.needed >= each - 1e-9).all()
    return margin


def stays_clear(scene, here, rng):
    """Bodies, by python-fcl: all pairs of a few displacements, and the nearest ones of all."""
    needed = np.array([pair[2] for pair in scene.pairs])
    spare = np.min([scene.distances(q) - needed for q in here.nominal[:5]], axis=0)
    near, seen = np.flatnonzero((spare < NEAR) | (np.argsort(np.argsort(spare)) < 3)), copy(scene)
    for k, (q, moved) in enumerate(zip(here.q, here.placement, strict=True)):
        goes = {"surface"} | set(scene.bodies if rng.random() < 0.5 else ())
        seen.bodies = {
            name: [(one._replace(placement=moved @ one.placement), model)
                   if one.link is None and name in goes else (one, model) for one, model in shapes]
            for name, shapes in scene.bodies.items()
        }  # fmt: skip
        which = np.arange(len(needed)) if k < 5 else near
        assert (seen.distances(q, which) >= needed[which] - 1e-6).all()
