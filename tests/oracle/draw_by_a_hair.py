"""One-cell cases whose target lies a hair inside or outside what the tolerance saves.

As `draw_tolerance_needed`, with a share of the tolerance just below or just above 1. Below, the
support point's own configuration covers the cell, so that no answer may be "infeasible". Above, no
configuration does (the support point is the best of many starts, found more than once), so that no
answer may be "feasible".

Run this file to draw the cases again.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from dense_replay import angles, placed
from draw_tolerance_needed import ARMS, narrowed_limits, support
from following import Arm
from planted import HERE, draw_and_write
from set_down import KINDS, built, random_shape, rounded, set_down

from robots import load_robot

HAIRS = (0.1, 0.03, 0.01, 1e-3, 1e-4)


class Hair(NamedTuple):
    """A case of one cell."""

    tables: dict[str, Any]
    share: float
    """Distance of the target from what can be reached, over the tolerance."""
    q: tuple[float, ...]
    """The nearest configuration."""

    @property
    def feasible(self) -> bool:
        """The truth."""
        return self.share < 1.0


def draw(rng: np.random.Generator, number: int) -> Hair | None:
    """One case, or None where the support point is not sure."""
    name, robot = ARMS[number % len(ARMS)], load_robot(ARMS[number % len(ARMS)])
    limits = {} if rng.random() < 0.3 else narrowed_limits(rng, robot)
    tables: dict[str, Any] = {
        "robot": {"name": name} | ({"limits_deg": limits} if limits else {}),
        "surface": rounded(random_shape(rng, str(rng.choice(KINDS)), rng.uniform(0.02, 0.3, 2)))
        | {"cells": [1, 1]},
        "task": {
            "standoff": round(float(rng.choice([0.0, rng.uniform(0.0, 0.05)])), 5),
            "cone_deg": round(float(np.exp(rng.uniform(np.log(0.5), np.log(90.0)))), 3),
            "tolerance": round(float(np.exp(rng.uniform(np.log(3e-4), np.log(1e-2)))), 6),
        },
    }
    share = 1.0 + float(rng.choice(HAIRS)) * (1.0 if rng.random() < 0.4 else -1.0)
    arm = Arm(built(tables).robot)
    w, approach = rng.normal(size=(2, 3))
    w, approach = w / np.linalg.norm(w), approach / np.linalg.norm(approach)
    cone = np.radians(tables["task"]["cone_deg"])
    best = support(arm, rng, w, approach, cone * (1.0 - 1e-6) if share < 1.0 else cone)
    if best is None:
        return None
    target = best.point + share * tables["task"]["tolerance"] * w
    tables = set_down(tables, np.array([0.5, 0.5]), target, approach, w)
    made = Hair(tables, share, tuple(float(x) for x in best.q))
    return made if keeps(made) == made.feasible else None


def keeps(case: Hair) -> bool:
    """Whether the case's configuration covers the cell."""
    setup = built(case.tables)
    surface, task, q = setup.cells.surface, setup.task, np.array(case.q)
    middle = np.array([surface.u_range, surface.v_range]).mean(axis=1)
    target, approach = placed(surface, task, *middle[:, None])
    point, axis, _, _ = Arm(setup.robot).tool(q)
    inside = (q >= setup.robot.lower).all() and (q <= setup.robot.upper).all()
    near = np.linalg.norm(point - target[0]) <= task.effective_tolerance
    return bool(inside and near and angles(axis[None], approach)[0] <= task.cone)


def read_hair(path: Path = HERE / "by_a_hair.json") -> list[Hair]:
    """The stored cases."""
    return [Hair(**case) for case in json.loads(path.read_text(encoding="utf-8"))]


if __name__ == "__main__":
    draw_and_write(draw, __doc__, "by_a_hair", wanted=120, seed=34)
