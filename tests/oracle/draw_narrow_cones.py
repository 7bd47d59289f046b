"""Random cases with cones of 0.05 to 1 degree, feasible by a motion exactly along the normals.

An arm is given a random configuration; a patch is set down with a random place at the tool point,
facing the tool. A raster over all cell centres is followed by inverse kinematics, the tool axis
exactly along the approach direction and the roll free. Where no joint has to jump, limits of some
joints are narrowed until they leave the motion little room; then the motion is measured densely.

Run this file to draw the cases again.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from following import Arm, follow, measured, raster, settled
from oracle_cases import Floats
from planted import Planted, draw_and_write
from set_down import KINDS, built, random_shape, rounded, set_down

from robots import Robot, load_robot

ARMS = (
    "puma560", "ur5", "panda", "kinova", "talos_left", "z1", "xarm7", "baxter_left",
    "centauro_left", "ur3", "tiago_no_hand",
)  # fmt: skip
SHAPES = ((1, 2), (2, 2), (2, 3), (3, 3), (1, 4), (4, 4), (4, 6), (6, 6))
MOST_SHARE = 0.5  # of tolerance and cone, that the planted motion may use
SMALL_STEP = 2e-3  # [m] between places of the raster


def narrowed(rng: np.random.Generator, robot: Robot, q: Floats) -> dict[str, Any]:
    """Limits in degrees, by name, for up to three joints: what a motion uses and a little more."""
    limits = {}
    for j in rng.permutation(robot.n)[: rng.integers(4)]:
        room = np.exp(rng.uniform(np.log(0.3), np.log(25.0), 2))
        low = max(np.degrees(q[:, j].min()) - room[0], np.degrees(robot.lower[j]))
        high = min(np.degrees(q[:, j].max()) + room[1], np.degrees(robot.upper[j]))
        limits[robot.joint_names[j]] = [round(float(low), 4), round(float(high), 4)]
    return limits


def draw(rng: np.random.Generator, number: int) -> Planted | None:
    """One case, or None where the planted motion does not come about."""
    name = ARMS[number % len(ARMS)]
    shape = SHAPES[int(rng.integers(len(SHAPES)))]
    tables: dict[str, Any] = {
        "robot": {"name": name},
        "surface": rounded(random_shape(rng, str(rng.choice(KINDS)), rng.uniform(0.05, 0.4, 2)))
        | {"cells": list(shape)},
        "task": {
            "standoff": round(float(rng.choice([0.0, rng.uniform(0.0, 0.05)])), 5),
            "cone_deg": round(float(np.exp(rng.uniform(np.log(0.05), 0.0))), 4),
            "tolerance": round(float(np.exp(rng.uniform(np.log(3e-4), np.log(5e-3)))), 6),
        },
    }
    robot = load_robot(name)
    arm = Arm(robot)
    q = arm.random(rng)
    point, axis, _, _ = arm.tool(q)
    tables = set_down(tables, rng.uniform(0.0, 1.0, 2), point, axis, rng.normal(size=3))
    setup = built(tables)
    way = raster(setup.cells, setup.task, "first", SMALL_STEP)
    start = _over_first_cell(arm, setup, way.uv[0], q)
    made = None if start is None else follow(arm, setup.cells, setup.task, way, start, 0.0)
    if made is None:
        return None
    limits = narrowed(rng, robot, made)
    if limits:
        tables["robot"]["limits_deg"] = limits
    setup = built(tables)
    kept = measured(setup.robot, setup.cells, setup.task, way, made)
    limit = setup.task.effective_tolerance
    if kept.distance > MOST_SHARE * limit or kept.tilt > MOST_SHARE * setup.task.cone:
        return None
    if kept.room < 0.0:
        return None
    why = (
        f"A planted motion strays {1e3 * kept.distance:.4f} of {1e3 * limit:.3f} mm, tilts "
        f"{np.degrees(kept.tilt):.4f} of {setup.task.cone_deg:g} deg, and keeps "
        f"{np.degrees(kept.room):.2f} deg from the limits."
    )
    return Planted(f"{number:03d}", tables, tuple(float(x) for x in made[0]), "first", why)


def _over_first_cell(arm: Arm, setup: Any, first: Floats, q: Floats) -> Floats | None:
    """Go from where the arm is to the first cell, in a straight line over the surface."""
    from following import Raster, placed

    surface, task = setup.cells.surface, setup.task
    point = arm.tool(q)[0]
    found = surface.closest(point)
    here = np.array([float(found.u), float(found.v)])
    part = np.linspace(0.0, 1.0, 120)[:, None]
    uv = here + part * (first - here)
    way = Raster(uv, np.full(len(uv), -1))
    rows = follow(arm, setup.cells, task, way, q, 0.0)
    if rows is None:
        return None
    target, approach = placed(surface, task, *first[None].T)
    start = settled(arm, rows[-1], target[0], approach[0], 0.0)
    return start if np.linalg.norm(arm.tool(start)[0] - target[0]) < 1e-6 else None


if __name__ == "__main__":
    draw_and_write(draw, __doc__, "narrow_cones", wanted=100, seed=32)
