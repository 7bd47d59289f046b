"""Roll in the kernels: its value, its gradient, and the bounds on it between samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dense_replay import tools
from random_arms import between, random_arm, random_configuration, random_turn, tilted
from scipy.spatial.transform import Rotation

from feasibility import Task
from feasibility.roadmap.motions.arrays import arrays_of
from feasibility.roadmap.motions.roll import (
    frame_rates,
    level,
    roll_gradient,
    roll_off_middle,
)
from feasibility.roadmap.motions.segment_bound import roll_spread, spread
from feasibility.roadmap.motions.working_memory import place, work_for
from feasibility.roll import roll_of
from robots import load_robot
from surfaces import plane

REAL = ("puma560", "ur5", "panda")


def references(robot, q):
    """The reference axes (k, 3) of configurations (k, n), by Pinocchio."""
    turned = replace(robot, approach_axis=robot.reference_axis, reference_axis=robot.approach_axis)
    return tools(turned, q)[1]


def twist(x, a, b, t):
    """Roll by its definition: the least rotation from a to b, then the angle from t about b."""
    axis = np.cross(a, b)
    sine = np.linalg.norm(axis)
    least = Rotation.from_rotvec(axis / max(sine, 1e-300) * np.arctan2(sine, a @ b))
    carried = least.apply(x)
    return np.arctan2(np.cross(b, t) @ carried, t @ carried)


def wrapped(angle):
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def test_roll_is_the_angle_left_by_the_least_rotation_onto_the_approach():
    """1,000 random frames, tilts up to 170 deg, any middle of the range."""
    rng = np.random.default_rng(1)
    for _ in range(1000):
        x, _, a = random_turn(rng).T
        b = tilted(a, rng.uniform(0.0, 2.97), rng)
        t = np.cross(b, rng.normal(size=3))
        t /= np.linalg.norm(t)
        middle = rng.uniform(-7.0, 7.0)
        off = roll_off_middle(np.array([np.zeros(3), b, t]), a, x, middle)
        assert -np.pi <= off <= np.pi
        assert abs(wrapped(off + middle - twist(x, a, b, t))) < 1e-10


@pytest.mark.parametrize("seed", range(6))
def test_the_gradient_is_that_of_roll(seed):
    """Against differences, on random arms with slides."""
    rng = np.random.default_rng(seed)
    robot = random_arm(rng)
    q = random_configuration(robot, rng)
    task = Task(0.0, 90, roll_deg=(-10, 10), roll_reference=(1, 0, 0))
    arrays = arrays_of(robot, plane((-1, 1), (-1, 1)).cells(1, 1), task)
    work, gradient = work_for(robot.n), np.empty(robot.n)
    place(arrays, work, 0, q)
    work.target[1] = tilted(work.axis[0], rng.uniform(0.0, 1.5), rng)
    work.target[2] = rng.normal(size=3)
    level(work.target)
    assert abs(work.target[2] @ work.target[1]) < 1e-14
    roll_gradient(work.target, work.axis[0], work.axes[0], arrays.chain.prismatic, gradient)
    step = 1e-6
    for j in range(robot.n):
        found = []
        for sign in (-1.0, 1.0):
            place(arrays, work, 1, q + sign * step * np.eye(robot.n)[j])
            found.append(work.error[1, 2])
        assert gradient[j] == pytest.approx(wrapped(found[1] - found[0]) / (2 * step), abs=1e-7)
    place(arrays, work, 1, q)
    np.testing.assert_allclose(work.reference[1], references(robot, q[None])[0], atol=1e-12)


def random_frame(rng, size):
    """A cubic b and t (4, 3) each, near unit vectors at right angles, that turn by about `size`."""
    frame = random_turn(rng)
    cubics = np.zeros((2, 4, 3))
    cubics[:, 0] = frame[:2]
    cubics[:, 1:] = rng.normal(size=(2, 3, 3)) * size * 10.0 ** rng.uniform(-2, 0, (2, 3, 1))
    return cubics


def along(cubics, s):
    """Values (k, 3) and first and second derivatives of a cubic (4, 3)."""
    powers = s[:, None] ** np.arange(4)
    return powers @ cubics


def made_right(b, t):
    """Unit b (k, 3), and t made a unit vector across it."""
    b = b / np.linalg.norm(b, axis=1)[:, None]
    t = t - (t * b).sum(axis=1)[:, None] * b
    return b, t / np.linalg.norm(t, axis=1)[:, None]


def bounds_of(cubics):
    """The arguments of `frame_rates` for cubics of b and t, by 400 samples."""
    s = np.linspace(0.0, 1.0, 401)
    (b, t), powers = (along(c, s) for c in cubics), s[:, None] ** np.arange(3)
    slope = np.linalg.norm(powers @ (cubics[1, 1:] * [[1], [2], [3]]), axis=1).max()
    ends = [np.linalg.norm(powers[:, :2] @ (c[2:] * [[2], [6]]), axis=1).max() for c in cubics]
    right = made_right(b, t)
    off, aside = (np.linalg.norm(c - r, axis=1).max() for c, r in zip((b, t), right, strict=True))
    return np.linalg.norm(b[-1] - b[0]), ends[0], slope, ends[1], off, aside


def test_the_turning_of_a_frame_is_bounded():
    """400 random frames, dense differences of their rotations; the bounds are not loose either."""
    rng = np.random.default_rng(2)
    s, used = np.linspace(0.0, 1.0, 201), []
    for _ in range(400):
        cubics = random_frame(rng, 10.0 ** rng.uniform(-2.5, -0.6))
        bounds = frame_rates(*bounds_of(cubics))
        if not bounds[0] < np.inf:
            continue
        b, t = made_right(along(cubics[0], s), along(cubics[1], s))
        turns = Rotation.from_matrix(np.stack([t, np.cross(b, t), b], axis=2))
        om = (turns[1:] * turns[:-1].inv()).as_rotvec() * 200.0
        speed = np.linalg.norm(np.diff(b, axis=0), axis=1).max() * 200.0
        whole = np.linalg.norm(om, axis=1).max()
        change = np.linalg.norm(np.diff(om, axis=0), axis=1).max() * 200.0
        found = np.array([speed, whole, change])
        assert (found <= np.array(bounds) * (1.0 + 1e-3) + 1e-6).all()
        used.append(found / np.maximum(bounds, 1e-9))
    assert len(used) > 300
    assert (np.median(used, axis=0) > 0.2).all()


@pytest.mark.parametrize("name", [*REAL, "random"])
def test_second_derivatives_bound_the_sag_of_roll(name):
    """80 segments an arm, steps up to 0.6 rad a joint, tilts to 60 deg, frames at rest or turning.

    Roll stays as near to its chord as the bound allows, some of it by a third of that; and it
    changes by no more than its rate.
    """
    rng = np.random.default_rng(sum(name.encode()))
    used = []
    robot = None if name == "random" else load_robot(name)
    for number in range(80):
        if name == "random" and number % 4 == 0:
            robot = random_arm(rng)
        q0 = random_configuration(robot, rng)
        step = rng.normal(size=robot.n) * 10.0 ** rng.uniform(-2.0, -0.3)
        step *= rng.random(robot.n) < rng.choice([0.4, 1.0])
        q1 = q0 + np.clip(step, -0.6, 0.6)
        task = Task(0.0, 90, roll_deg=(-10, 10), roll_reference=(1, 0, 0))
        arrays = arrays_of(robot, plane((-1, 1), (-1, 1)).cells(1, 1), task)
        work = work_for(robot.n)
        s, q = between(q0, q1, 24)
        (_, axes), x = tools(robot, q), references(robot, q)
        cubics = random_frame(rng, 0.0 if rng.random() < 0.4 else 10.0 ** rng.uniform(-2, -0.8))
        onto = Rotation.align_vectors(tilted(axes[0], rng.uniform(0.0, 1.0), rng), cubics[0, 0])[0]
        cubics = onto.apply(cubics.reshape(-1, 3)).reshape(2, 4, 3)
        b, t = made_right(along(cubics[0], s), along(cubics[1], s))
        chord = np.linalg.norm(axes - b, axis=1).max() * (1.0 + 1e-3)
        place(arrays, work, 0, q0)
        place(arrays, work, 1, q1)
        spread(arrays, work, q0, q1)
        work.derivative_bound[5:8] = frame_rates(*bounds_of(cubics))
        rate, most = roll_spread(work, chord, 1.0)
        if not (chord < 1.3 and most < np.inf):
            continue
        psi = np.unwrap(roll_of(x, axes, t, b))
        sag = np.abs(psi - (1.0 - s) * psi[0] - s * psi[-1])
        allowed = 0.5 * most * s * (1.0 - s)
        assert (sag <= allowed + 1e-9).all()
        assert np.abs(psi - psi[0]).max() <= rate + 1e-9
        if most > 1e-4:
            used.append((sag[1:-1] / allowed[1:-1]).max())
    assert len(used) > 35
    assert max(used) > 0.35
