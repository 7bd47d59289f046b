"""Random cases that are feasible, but not over the exact centres of all cells.

One place of the surface is the furthest that the tool can be in some direction w, with its axis in
the cone and its joints in their limits (a support point p* of the set that the tool can reach). The
target of the last cell is set beyond it, at p* + share * tolerance * w: no configuration is nearer
than share * tolerance to it, and the support point's own configuration is just that near. The patch
leads away from there against w. The motion to the other cells is followed by inverse kinematics,
measured densely, and kept only if room is left everywhere.

Run this file to draw the cases again.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from following import Arm, Raster, follow, measured, raster
from oracle_cases import Floats
from planted import Planted, draw_and_write
from scipy.optimize import minimize
from set_down import KINDS, built, random_shape, rounded, set_down

from robots import Robot, load_robot

ARMS = ("puma560", "ur5", "panda", "kinova", "so101", "z1", "ur10_limited", "xarm7", "talos_left")
SHAPES = ((1, 1), (1, 1), (2, 2), (3, 3), (1, 3), (2, 3))
MOST_SHARE = 0.9  # of tolerance and cone, that the planted motion may use
STARTS = 24


class Support(NamedTuple):
    """The furthest that the tool gets."""

    q: Floats
    point: Floats
    axis: Floats


def narrowed_limits(rng: np.random.Generator, robot: Robot) -> dict[str, Any]:
    """Random limits for about half of the joints, by name, degrees."""
    limits = {}
    for j, name in enumerate(robot.joint_names):
        low, high = np.degrees([robot.lower[j], robot.upper[j]])
        if not np.isfinite([low, high]).all():
            low, high = -180.0, 180.0
        if rng.random() < 0.5:
            ends = np.sort(rng.uniform(low, high, 2))
            if ends[1] - ends[0] > 25.0:
                limits[name] = [round(float(ends[0]), 3), round(float(ends[1]), 3)]
    return limits


def support(
    arm: Arm, rng: np.random.Generator, w: Floats, approach: Floats, cone: float
) -> Support | None:
    """The configuration that brings the tool furthest along w, of many starts; None if unsure."""
    low = np.where(np.isfinite(arm.lower), arm.lower, None)
    high = np.where(np.isfinite(arm.upper), arm.upper, None)
    inside = np.cos(cone)
    held = {
        "type": "ineq",
        "fun": lambda q: arm.tool(q)[1] @ approach - inside,
        "jac": lambda q: approach @ arm.tool(q)[3],
    }
    found = []
    for _ in range(STARTS):
        made = minimize(
            lambda q: -float(w @ arm.tool(q)[0]),
            arm.random(rng),
            jac=lambda q: -w @ arm.tool(q)[2],
            bounds=list(zip(low, high, strict=True)),
            constraints=[held],
            method="SLSQP",
            options={"maxiter": 120, "ftol": 1e-12},
        )
        q = np.clip(made.x, arm.lower, arm.upper)
        if np.isfinite(q).all() and arm.tool(q)[1] @ approach >= inside - 1e-7:
            found.append((float(w @ arm.tool(q)[0]), tuple(q)))
    found.sort(reverse=True)
    # The best must have been found more than once, or a better one may be about.
    if len(found) < 3 or found[0][0] - found[2][0] > 1e-6:
        return None
    q = np.array(found[0][1])
    point, axis, _, _ = arm.tool(q)
    return Support(q, point, axis)


def draw(rng: np.random.Generator, number: int) -> Planted | None:
    """One case, or None where the planted motion does not come about."""
    name = ARMS[number % len(ARMS)]
    shape = SHAPES[int(rng.integers(len(SHAPES)))]
    tolerance = round(float(np.exp(rng.uniform(np.log(5e-4), np.log(1e-2)))), 6)
    cone_deg = round(float(np.exp(rng.uniform(np.log(2.0), np.log(90.0)))), 3)
    # Outstretched (the arm's own limits) or at narrowed limits.
    limits = {} if rng.random() < 0.3 else narrowed_limits(rng, load_robot(name))
    share = round(float(rng.uniform(0.1, 0.8)), 3)
    spans = np.array(shape) * rng.uniform(0.02, 0.1, 2)
    tables = {
        "robot": {"name": name} | ({"limits_deg": limits} if limits else {}),
        "surface": rounded(random_shape(rng, str(rng.choice(KINDS)), spans))
        | {"cells": list(shape)},
        "task": {
            "standoff": round(float(rng.choice([0.0, rng.uniform(0.0, 0.05)])), 5),
            "cone_deg": cone_deg,
            "tolerance": tolerance,
        },
    }
    robot = built(tables).robot
    arm = Arm(robot)
    w, approach = rng.normal(size=3), rng.normal(size=3)
    w /= np.linalg.norm(w)
    approach -= rng.uniform(0.2, 1.0) * (approach @ w) * w  # a patch leads away from its border
    approach /= np.linalg.norm(approach)
    best = support(arm, rng, w, approach, np.radians(cone_deg))
    if best is None:
        return None
    target = best.point + share * tolerance * w
    place = 1.0 - 0.5 / np.array(shape)
    tables = set_down(tables, place, target, approach, w)
    return accepted(tables, best.q, share, f"{number:03d}")


def accepted(tables: dict[str, Any], q: Floats, share: float, name: str) -> Planted | None:
    """The case, if a motion from q at its last cell covers all with room to spare."""
    setup = built(tables)
    task, arm = setup.task, Arm(setup.robot)
    way: Raster = raster(setup.cells, task, "last")
    cone = task.cone * MOST_SHARE
    made = follow(arm, setup.cells, task, way, q, cone)
    if made is None:
        return None
    kept = measured(setup.robot, setup.cells, task, way, made)
    limit = task.effective_tolerance
    if kept.distance > MOST_SHARE * limit or kept.tilt > 0.97 * task.cone or kept.room < 0.0:
        return None
    why = (
        f"The last cell is {1e3 * share * limit:.3f} mm beyond the furthest tool point, the "
        f"tolerance {1e3 * limit:.3f} mm; a planted motion strays {1e3 * kept.distance:.3f} mm and "
        f"tilts {np.degrees(kept.tilt):.3f} of {task.cone_deg:g} deg."
    )
    return Planted(name, tables, tuple(float(x) for x in q), "last", why)


if __name__ == "__main__":
    draw_and_write(draw, __doc__, "tolerance_needed", wanted=100, seed=31)
