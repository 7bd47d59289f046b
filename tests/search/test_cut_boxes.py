"""What contraction keeps of boxes around known points of the motion set: the points."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from plain import tools
from random_arms import rail_arm, random_arm, random_configuration, tilted, turn_onto
from referee import unit
from samples import sampled, seeds
from search_kernels import contracted

from coverable import Task, cone, cylinder, hyperboloid, load_robot, plane, sphere, torus
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.proofs.boxes import place_at_rest
from feasibility.roadmap.proofs.target_places import places_on
from feasibility.roll import projected, roll_of

ARMS = {
    **{name: (lambda rng, name=name: load_robot(name)) for name in ("puma560", "ur5", "panda")},
    "kinova": lambda rng: load_robot("kinova"),
    "ur5 on a rail": lambda rng: rail_arm("ur5"),
    "random": random_arm,
}
KINDS = ("plane", "sphere", "cylinder", "hyperboloid", "cone", "torus")


class Known(NamedTuple):
    """A configuration of the motion set, and the parts of the surface that explain it."""

    arrays: object
    places: object
    at_rest: object  # the target alone
    q: np.ndarray
    parts: np.ndarray  # (k,) parts that the place lies on
    x: np.ndarray  # (k, 2) its parameters there


def random_patch(kind, side, rng):
    size, (a, b) = float(rng.uniform(0.2, 1.0)), rng.uniform(20, 90, 2)
    start, other = float(rng.uniform(0, 200)), float(rng.uniform(0.3, 1.0))
    return {
        "plane": lambda: plane((-0.3, 0.3), (-0.2, 0.4), side=side),
        "sphere": lambda: sphere(size, (90 - a, 90 + a), (start, start + b), side=side),
        "cylinder": lambda: cylinder(size, (start, start + b), (-0.2, 0.3), side=side),
        "hyperboloid": lambda: hyperboloid(size, other, (start, start + b), (-0.3, 0.2), side=side),
        "cone": lambda: cone(size, other, (start, start + b), (0.05, 0.2), side=side),
        "torus": lambda: torus(1.0, 0.3 * size, (start, start + b), (start, start + a), side=side),
    }[kind]()


def known_point(arm, kind, rng):
    """A random configuration, and a surface put where it just holds the tool over it."""
    robot = ARMS[arm](rng)
    q = random_configuration(robot, rng)
    (point,), (axis,) = tools(robot, q[None])
    surface = random_patch(kind, str(rng.choice(["inside", "outside"])), rng)
    cone_deg = float(rng.choice([0.5, 5.0, 45.0, 120.0, 180.0]))
    standoff, tolerance = float(rng.choice([0.0, 0.02])), float(rng.choice([1e-4, 1e-3, 0.02]))
    task = Task(standoff, cone_deg, tolerance)
    cells = surface.cells(4, 5)
    cell, targets = int(rng.integers(len(cells))), task.targets(cells)
    offset = 0.999 * task.effective_tolerance * unit(rng.normal(size=3))
    approach = tilted(axis, 0.9999 * task.cone, rng)
    turn = turn_onto(targets.approaches[cell], approach, rng)
    surface = surface.moved(turn, point + offset - turn @ targets.points[cell])
    if cone_deg <= 90.0:
        task = with_roll(task, robot, surface, q, axis, approach, rng)
    arrays, places = arrays_of(robot, surface.cells(4, 5), task), places_on(surface, task)
    parts, x = explained(places, point + offset, approach)
    assert len(parts) > 0
    return Known(arrays, places, place_at_rest(arrays, cell), q, parts, x)


def with_roll(task, robot, surface, q, axis, approach, rng):
    """The task with a range of roll that holds what q has, up to 0.1 percent."""
    reference = surface.rotation.T @ rng.normal(size=3)
    t, sine = projected(surface.rotation @ reference, approach)
    if sine < 0.3 * np.linalg.norm(reference):
        return task
    turned = replace(robot, approach_axis=robot.reference_axis, reference_axis=robot.approach_axis)
    (x,) = tools(turned, q[None])[1]
    half = float(rng.choice([0.01, 0.5, 10.0, 60.0, 170.0]))
    middle = np.degrees(roll_of(x, axis, t, approach)) + rng.choice([-0.999, 0.0, 0.999]) * half
    middle = float(np.mod(middle + 180.0, 360.0) - 180.0)
    limits = (middle - half, middle + half)
    return replace(task, roll_deg=limits, roll_reference=tuple(reference.tolist()))


def explained(places, point, approach):
    """The parts (k,) of which a target and an approach direction obey the model, and x (k, 2)."""
    slopes = places.slopes[..., :6].transpose(0, 2, 1)  # (K, 6, 2)
    away = np.concatenate([point, approach]) - places.centre[:, :6]
    x = np.clip(np.einsum("kxd,kd->kx", np.linalg.pinv(slopes), away), -1.0, 1.0)
    off = away - np.einsum("kdx,kx->kd", slopes, x)
    lengths = np.stack([np.linalg.norm(off[:, :3], axis=1), np.linalg.norm(off[:, 3:], axis=1)], 1)
    parts = np.flatnonzero((lengths <= places.radius[:, :2] + 1e-12).all(axis=1))
    return parts, x[parts]


def loses(known, rng):
    """Is a known point lost, or its box discarded, by one random box around it?"""
    k, n = int(rng.integers(len(known.parts))), len(known.q)
    y = np.concatenate([known.q, known.x[k]])
    width = 10.0 ** rng.uniform(-4.0, 0.5) * 10.0 ** rng.uniform(-1.0, 0.0, n + 2)
    width[rng.random(n + 2) < 0.1] = 0.0
    width[:n] *= rng.choice([1.0, 1e-3])  # or else what the place adds is never seen
    share = np.clip(rng.uniform(-0.2, 1.2, n + 2), 0.0, 1.0)
    low, high = y - share * width, y + (1.0 - share) * width
    low[n:], high[n:] = np.maximum(low[n:], -1.0), np.minimum(high[n:], 1.0)
    low, high = np.minimum(low, y), np.maximum(high, y)
    places, part = known.places, int(known.parts[k])
    if rng.random() < 0.3:
        places, part, low, high, y = known.at_rest, 0, low[:n], high[:n], y[:n]
    kept, low, high = contracted(known.arrays, places, part, low, high)
    return not (kept and (low - 1e-9 <= y).all() and (y <= high + 1e-9).all())


@sampled("seed", seeds(1, all=60))
@pytest.mark.parametrize("arm", ARMS)
def test_no_box_loses_a_known_point(arm, seed):
    """Six kinds of surfaces, 25 boxes each; tolerance and cone are used up to 0.1 percent."""
    rng = np.random.default_rng([seed, sum(arm.encode())] if seed else sum(arm.encode()))
    for kind in KINDS:
        known = known_point(arm, kind, rng)
        assert not any(loses(known, rng) for _ in range(25)), kind


@pytest.mark.parametrize("column", [0, 1], ids=["tolerance", "cone"])
def test_a_wrong_bound_would_be_found(column):
    """With less tolerance or cone than the point needs, boxes lose it."""
    rng, lost = np.random.default_rng(3), 0
    for kind in KINDS:
        known = known_point("puma560", kind, rng)
        arrays = known.arrays
        less = {"tolerance": 0.5 * arrays.tolerance} if column == 0 else {
            "cone_chord": 0.5 * arrays.cone_chord}  # fmt: skip
        finest = known.places.radius[known.parts, column].argmin()
        tight = known._replace(
            arrays=arrays._replace(**less),
            parts=known.parts[[finest]],
            x=known.x[[finest]],
            places=known.places._replace(radius=np.zeros_like(known.places.radius)),
        )
        lost += any(loses(tight, rng) for _ in range(40))
    assert lost >= 2
