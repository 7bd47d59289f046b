"""A formula of one's own, points sampled from it and poses over it get the verdict of the patch."""

import numpy as np
import pytest
from user_formulas import EQUAL, sampled

from feasibility import Answer, Task, check
from robots import load_robot
from surfaces import grid, hyperboloid, parametric, poses, sphere, torus

UR5, PUMA = load_robot("ur5"), load_robot("puma560", limits="set-1")
NEAR, FAR = Task(0.005, 45.0), Task(0.02, 40.0)
PATCHES = {
    "sphere": lambda **pose: sphere(1.0, (10, 90), (10, 180), **pose),
    "torus": lambda **pose: torus(0.5, 0.125, (0, 90), (-80, 100), **pose),
    "hyperboloid": lambda **pose: hyperboloid(0.5, 0.5, (130, 220), (0.0, 0.5), **pose),
}
QUESTIONS = {
    # kind, arm, task, side, position, cells, the cells that are missed
    "sphere": ("sphere", PUMA, NEAR, "inside", (0.0, 0.0, 0.0), (3, 4), []),
    "sphere out of reach": ("sphere", PUMA, NEAR, "inside", (0.5, 0.0, 0.0), (3, 4), [8]),
    "torus": ("torus", UR5, FAR, "outside", (0.0, -0.2, 0.1), (3, 4), []),
    "torus out of reach": ("torus", UR5, FAR, "outside", (0.3, -0.8, 0.2), (3, 3), [0, 1, 2]),
    "waist": ("hyperboloid", PUMA, NEAR, "inside", (0.0, 0.0, 0.1), (3, 3), []),
    "waist out of reach": (
        "hyperboloid", UR5, FAR, "outside", (1.3, 0.2, 0.1), (3, 3), [0, 1, 2],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", QUESTIONS)
def test_the_verdict_is_that_of_the_patch(name):
    kind, arm, task, side, position, shape, missed = QUESTIONS[name]
    pose = {"side": side, "position": position}
    formula, u, v, _ = EQUAL[kind]
    cells = PATCHES[kind](**pose).cells(*shape)
    middles = cells.centres
    apart = np.linalg.norm(middles[cells.pairs[:, 0]] - middles[cells.pairs[:, 1]], axis=1)
    same = {
        "patch": cells,
        "formula": parametric(formula, u, v, **pose).cells(*shape),
        "grid": grid(sampled(formula, u, v, (25, 33)), **pose).cells(*shape),
        "poses": poses(middles, cells.normals, neighbours=1.01 * apart.max(), side=side),
    }
    expected = Answer.INFEASIBLE if missed else Answer.FEASIBLE
    for surface, asked in same.items():
        verdict = check(arm, asked, task)
        assert verdict.answer is expected, (surface, verdict.message)
        assert np.flatnonzero(~verdict.covered).tolist() == missed, surface
