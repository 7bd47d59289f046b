"""Random arms, surfaces and straight joint segments, and dense sampling by Pinocchio."""

import numpy as np
from arm_urdfs import RIGHT_ANGLES, Floats, arm, finite_limits, joint, random_joints
from asked import question
from referee import unit

from coverable import Axis, Robot, Surface, Task, cylinder, hyperboloid, load_robot, plane, sphere
from robots.from_urdf import robot_from_urdf
from robots.kinematics import Kinematics
from robots.urdf.checked_urdf import checked_tree
from robots.urdf.elements import parse_xml


def robot_of(joints: list[str], approach_axis: tuple[float, ...] = (0.0, 0.0, 1.0)) -> Robot:
    root = parse_xml(arm(joints).encode(), "URDF text", encoding="utf-8")
    checked = checked_tree(root, "URDF text", "/nowhere", ())
    return robot_from_urdf(checked, name="test_arm", approach_axis=approach_axis)


def random_arm(rng: np.random.Generator, least: int = 3, most: int = 8) -> Robot:
    return robot_of(*random_joints(rng, least, most))


def planar_arm(links: int = 3, limits: tuple[float, float] = (-2.8, 2.8)) -> Robot:
    """Parallel axes along z, links of 0.3 m along x; the tool axis is x, in the plane."""
    joints = [
        joint(i, xyz=(0.3 if i > 1 else 0.0, 0.0, 0.0), limits=limits) for i in range(1, links + 1)
    ]
    return robot_of([*joints, joint(links + 1, "fixed", (0.3, 0.0, 0.0))], (1.0, 0.0, 0.0))


def rail_arm(base: str, stroke: tuple[float, float] = (-0.5, 0.8)) -> Robot:
    """A library arm that rides on a rail along y."""
    return load_robot(base, axes=[Axis("rail", "prismatic", (0, 1, 0), limits=stroke)])


def random_configuration(robot: Robot, rng: np.random.Generator) -> Floats:
    """A configuration inside the limits; in a third of the cases with joints at round values."""
    low, high = finite_limits(robot)
    q = rng.uniform(low, high)
    if rng.random() < 0.33:
        values = np.stack([np.clip(rng.choice(RIGHT_ANGLES, robot.n), low, high), low, high, q])
        q = values[rng.choice(4, robot.n, p=[0.4, 0.1, 0.1, 0.4]), np.arange(robot.n)]
    return np.ascontiguousarray(q)


def between(q0: Floats, q1: Floats, samples: int) -> tuple[Floats, Floats]:
    """Shares s (samples + 1,) from 0 to 1, and the configurations of a straight segment there."""
    s = np.linspace(0.0, 1.0, samples + 1)
    return s, q0 + s[:, None] * (q1 - q0)


def seen(robot: Robot, q: Floats, a: int, b: int, points: Floats) -> Floats:
    """Points (k, 3) of joint b as seen from joint a (m, k, 3), at configurations q (m, n)."""
    frames = Kinematics(robot).joints(q)
    world = np.einsum("mij,kj->mki", frames.rotations[:, b], points) + frames.points[:, None, b]
    return np.einsum("mji,mkj->mki", frames.rotations[:, a], world - frames.points[:, None, a])


def turn_onto(start: Floats, end: Floats, rng: np.random.Generator) -> Floats:
    """A random rotation (3, 3) that brings one unit vector onto another."""

    def frame(z: Floats) -> Floats:
        x = unit(np.cross(z, rng.normal(size=3)))
        return np.column_stack([x, np.cross(z, x), z])

    return frame(end) @ frame(start).T


def tilted(axis: Floats, angle: float, rng: np.random.Generator) -> Floats:
    """A unit vector at an angle (rad) from a unit vector, in a random direction."""
    across = unit(np.cross(axis, rng.normal(size=3)))
    return np.cos(angle) * axis + np.sin(angle) * across


def random_surface(rng: np.random.Generator, kind: str) -> Surface:
    """A large patch of one kind, lengths of 0.2 to 1 m, either side, in its own frame."""
    side = str(rng.choice(["inside", "outside"]))
    size = float(rng.uniform(0.2, 1.0))
    if kind == "sphere":
        return sphere(size, (0, 180), (-180, 180), side=side)
    if kind == "cylinder":
        return cylinder(size, (-180, 180), (-5, 5), side=side)
    if kind == "hyperboloid":
        flare = float(rng.uniform(0.3, 1.0))
        return hyperboloid(size, flare, (-180, 180), (-0.6, 0.6), side=side)
    return plane((-5, 5), (-5, 5), side=side)


def deviation(surface: Surface, points: Floats, axes: Floats) -> Floats:
    """(k,) |a - b| of the tool axis from the approach, at tool points and axes (k, 3)."""
    return np.linalg.norm(axes + surface.side_sign * surface.closest(points).normal, axis=1)


SMALL = "small dome", "plate", "panda over a saddle", "on a rail"
QUESTIONS = {name: question(name)[2:5] for name in SMALL} | {
    "tube": (question("small dome").robot, cylinder(1.0, (20, 60), (0.0, 0.4)).cells(3, 3),
             Task(0.005, 100)),
}  # fmt: skip
"""Robot, cells and task of small feasible questions."""
