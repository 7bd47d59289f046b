"""A sample of the planted cases: do their motions really cover, and is their kind what it says?"""

import numpy as np
import pytest
from draw_between_curves import moves, read_between
from draw_tolerance_needed import SHAPES
from following import Arm, settled
from planted import assert_covers, planted_motion, read_planted

TOLERANCE_NEEDED = read_planted("tolerance_needed")
NARROW = read_planted("narrow_cones")
SAMPLE = np.random.default_rng(8)


@pytest.mark.parametrize("number", SAMPLE.choice(len(TOLERANCE_NEEDED), 5, replace=False).tolist())
def test_a_motion_within_the_tolerance_covers_all(number):
    setup, way, q = planted_motion(TOLERANCE_NEEDED[number], 4e-3, 0.9)
    assert_covers(setup, way, q, 0.98)
    points = setup.task.targets(setup.cells).points
    arm, rng = Arm(setup.robot), np.random.default_rng(number)
    approach = setup.task.targets(setup.cells).approaches[-1]
    nearest = np.inf
    for _ in range(40):  # no configuration reaches the last centre
        found = settled(arm, arm.random(rng), points[-1], approach, setup.task.cone)
        point, axis, _, _ = arm.tool(found)
        if np.linalg.norm(axis - approach) <= 2.0 * np.sin(0.5 * setup.task.cone) + 1e-9:
            nearest = min(nearest, float(np.linalg.norm(point - points[-1])))
    assert nearest > 0.09 * setup.task.effective_tolerance


@pytest.mark.parametrize("number", SAMPLE.choice(len(NARROW), 3, replace=False).tolist())
def test_a_motion_along_the_normals_covers_all(number):
    setup, way, q = planted_motion(NARROW[number], 2e-3, 0.0)
    assert_covers(setup, way, q, 0.6)


def test_the_patch_holds_a_motion_between_the_curves():
    case = read_between()[int(SAMPLE.integers(10))]
    assert moves(case.problem) is not None


def test_the_planted_cases_are_of_many_arms_and_kinds():
    for cases, arms, count in ((TOLERANCE_NEEDED, 6, 100), (NARROW, 6, 100)):
        assert len(cases) >= count
        assert len({case.tables["robot"]["name"] for case in cases}) >= arms
        assert len({case.tables["surface"]["kind"] for case in cases}) == 6
    assert {tuple(case.tables["surface"]["cells"]) for case in TOLERANCE_NEEDED} == set(SHAPES)
    cones = [case.tables["task"]["cone_deg"] for case in NARROW]
    assert 0.04 < min(cones) < 0.08
    assert max(cones) <= 1.0
