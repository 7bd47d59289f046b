"""Configurations with the tool on a surface by construction, and random boxes around them."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from part_walks import at_parameters
from random_arms import random_arm
from scipy.spatial.transform import Rotation

from feasibility import Task
from feasibility.certification.cut_proofs.box_cutting import smaller
from feasibility.certification.cut_proofs.empty_region import Claim, Emptiness
from feasibility.certification.cut_proofs.linear_models import (
    Allowed,
    ArmModel,
    Boxes,
    target_parts,
)
from feasibility.certification.cut_proofs.region import JointRegion
from feasibility.certification.rolls import reference_axes
from feasibility.roll import projected, roll_of
from robots import Kinematics
from surfaces import cone, cylinder, hyperboloid, plane, sphere, torus

PATCHES = (
    plane((-0.3, 0.3), (-0.2, 0.4)),
    sphere(0.5, (10, 170), (-160, 160), side="outside"),
    sphere(1.2, (40, 100), (0, 90), side="inside"),
    cylinder(0.3, (-100, 100), (-0.4, 0.4), side="outside"),
    hyperboloid(0.4, 0.3, (0, 200), (-0.3, 0.4), side="inside"),
    cone(0.4, 0.5, (0, 300), (-0.2, 0.3), side="outside"),
    torus(0.5, 0.2, (0, 360), (0, 360), side="outside"),
)
FAR = 8.0  # [rad], [m] that regions may pass the limits by
EXACT = 0.3  # share of deviations, tilts and box faces that are as large as they may be


class Known(NamedTuple):
    """A configuration, boxes that hold it, and how it lies in them."""

    emptiness: Emptiness
    region: JointRegion
    boxes: Boxes
    places: np.ndarray
    """(m, n + 2) the configuration and x in the part of each box."""


def up_to(rng, most):
    """A random number up to `most`, often `most` itself."""
    return most if rng.random() < EXACT else most * rng.random()


def turned_by(rng, vector, angle):
    """A unit vector at an angle (rad) from another."""
    across = np.cross(vector, rng.normal(size=3))
    return Rotation.from_rotvec(angle * across / np.linalg.norm(across)).apply(vector)


def known(rng, boxes=50):
    """A random arm at a random configuration, a patch moved to its tool, and boxes around both."""
    robot = random_arm(rng)
    finite = np.clip(np.column_stack([robot.lower, robot.upper]), -4.0, 4.0)
    robot = robot.with_limits(finite)
    q = rng.uniform(robot.lower, robot.upper)
    point, axis = Kinematics(robot).tool(q)
    tolerance, angle = np.exp(rng.uniform(np.log([1e-4, 1e-3]), np.log([0.05, 3.0])))
    patch = PATCHES[rng.integers(len(PATCHES))]
    standoff = rng.choice([0.0, 0.01])
    u, v = (np.array([rng.uniform(*span)]) for span in (patch.u_range, patch.v_range))
    approach = turned_by(rng, axis, up_to(rng, angle))
    turn = Rotation.align_vectors(approach[None], -patch.side_sign * patch.normal(u, v))[0]
    turn = (Rotation.from_rotvec(approach * rng.uniform(-np.pi, np.pi)) * turn).as_matrix()
    patch = patch.moved(turn, np.zeros(3))
    off = rng.normal(size=3)
    target = point + up_to(rng, tolerance) * off / np.linalg.norm(off)
    patch = patch.moved(
        np.eye(3), target - (patch.point(u, v) + patch.side_sign * standoff * patch.normal(u, v))[0]
    )
    chord = 2.0 * np.sin(angle / 2.0)
    task = Task(standoff, 90.0)
    if angle < np.pi / 2 and rng.random() < 0.5:
        task = rolled_task(rng, robot, q, patch, (u, v), standoff)
    finest = patch.parts(0.3 * tolerance, 0.3 * chord, 600)
    parts = target_parts(finest, patch.cells(1, 1), task)
    arm = ArmModel(robot, robot.lower - FAR, robot.upper + FAR)
    allowed = Allowed(tolerance, chord, 0.5, task.roll)
    emptiness = Emptiness(arm, parts, lambda cell: 0, allowed, lambda: None)
    part, x = at_parameters(patch, u, v)
    made, places = boxes_around(rng, robot, q, parts, int(part[0]), x[0], boxes)
    return Known(emptiness, region_around(rng, robot, q), made, places)


def rolled_task(rng, robot, q, patch, place, standoff):
    """A task with a fixed reference, and a range that the roll at q is just inside of."""
    _, axis = Kinematics(robot).tool(q)
    b = -patch.side_sign * patch.normal(*place)[0]
    reference = rng.normal(size=3)
    along = patch.rotation @ (reference / np.linalg.norm(reference))
    roll = roll_of(reference_axes(robot, q[None])[0], axis, projected(along, b)[0], b)
    half = np.exp(rng.uniform(np.log(1e-3), np.log(np.pi / 2)))
    middle = roll + rng.choice([-1.0, 0.0, 1.0]) * 0.999 * half
    low, high = np.degrees([middle - half, middle + half])
    return Task(standoff, 90.0, roll_deg=(low, high), roll_reference=tuple(reference))


def boxes_around(rng, robot, q, parts, part, x, count):
    """Random boxes (count) that hold q and x, which belongs to `part`, and the places in them."""
    path = [(part, x)]
    while parts.children[path[-1][0], 0] >= 0:
        path.append(child_of(parts, *path[-1]))
    low, high, places, which = [], [], [], []
    for _ in range(count):
        part, x = path[rng.integers(len(path))]
        place = np.append(q, x)
        size = np.exp(rng.uniform(np.log(1e-7), np.log(3.0))) * np.exp(rng.normal(size=len(place)))
        below, above = (up_to(rng, 1.0) * size * rng.random(len(place)) for _ in range(2))
        below[rng.random(len(place)) < 0.15] = 0.0
        above[rng.random(len(place)) < 0.15] = 0.0
        ends = [np.append(robot.lower, [-1.0, -1.0]), np.append(robot.upper, [1.0, 1.0])]
        low.append(np.maximum(place - below, ends[0]))
        high.append(np.minimum(place + above, ends[1]))
        places.append(place)
        which.append(part)
    numbers = np.arange(count)
    return Boxes(np.array(low), np.array(high), np.array(which), numbers), np.array(places)


def child_of(parts, part, x):
    """A child that holds the place x of a part, and x in it."""
    axis = parts.axis[part]
    side = 0 if x[axis] <= 0.0 else 1
    inner = x.copy()
    inner[axis] = 2.0 * x[axis] + (1.0 if side == 0 else -1.0)
    return int(parts.children[part, side]), inner


def region_around(rng, robot, q):
    """All limits, and up to two weighted sums of q inside intervals, at an end of them or equal."""
    region = JointRegion.box(robot.lower, robot.upper)
    for _ in range(rng.integers(3)):
        weights = rng.normal(size=robot.n) * (rng.random(robot.n) < 0.6)
        value = float(weights @ q)
        below, above = (rng.choice([0.0, 1e-6, 1.0, np.inf]) for _ in range(2))
        if np.count_nonzero(weights) > 1:
            region = region.within(weights, value - below, value + above)
    return region


def lost(case):
    """(m,) boxes that the verifier drops, or contracts or cuts so that the place is outside."""
    left, models, _ = case.emptiness.examine(case.boxes, case.region)
    parts = case.emptiness.parts
    made = smaller(left, models, parts, case.emptiness.allowed.length)
    missed = np.ones(len(case.boxes), dtype=bool)
    at = [
        dict(within(parts, part, place))
        for part, place in zip(case.boxes.part.tolist(), case.places, strict=True)
    ]
    for i, (box, part) in enumerate(zip(made.claim.tolist(), made.part.tolist(), strict=True)):
        if part in at[box] and holds(made.low[i], made.high[i], at[box][part]):
            missed[box] = False
    return missed


def within(parts, part, place):
    """The place in a part, its child there, the child of that, and so on."""
    yield part, place
    while parts.children[part, 0] >= 0:
        part, x = child_of(parts, part, place[-2:])
        place = np.append(place[:-2], x)
        yield part, place


def holds(low, high, place):
    """Whether a box holds the place."""
    return ((place >= low - 1e-15) & (place <= high + 1e-15)).all()


class NoRefutation:
    """A search for refutations that finds none, so that the bounds alone have to refuse."""

    def find(self, *_):
        """Nothing."""


def confirmed(rng, case, most):
    """Whether some region that holds the known place is said to be empty, of three random ones.

    Joints that turn may be some turns away from it: the tool is at the same place there.
    """
    q, arm = case.places[0][:-2], case.emptiness.arm
    for _ in range(3):
        size = np.exp(rng.uniform(np.log(1e-6), np.log(8.0), (2, arm.n)))
        size[:, rng.random(arm.n) < 0.2] = 0.0
        turns = np.where(arm.prismatic, 0, 2.0 * np.pi * rng.integers(-1, 2, arm.n))
        region = replace(case.region, low=q - size[0], high=q + size[1])
        if len(region.weights) == 0:
            region = replace(region, low=region.low + turns, high=region.high + turns)
        claims = [Claim("a region", region, None)]
        if case.emptiness.test(claims, NoRefutation(), most).failed is None:
            return True
    return False
