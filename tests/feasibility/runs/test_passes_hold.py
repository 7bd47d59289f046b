"""Motions along passes over random surfaces, before a referee that shares nothing with us."""

from __future__ import annotations

import pytest
from foreign_passes import KINDS, ROUNDING, drawn, worst

from feasibility import verify
from feasibility.paths import coverage_path
from feasibility.timing import trajectory
from surfaces import SurfaceError

SAMPLE = range(len(KINDS))  # 200: make campaign NAME=passes
SPEED = 0.2


def assert_holds(number: int) -> bool:
    """Whether a motion was found; what is called feasible is right over the surface itself."""
    case = drawn(number)
    try:
        along = case.planned
    except SurfaceError:  # the tool would have to be lifted further
        return False
    robot, cells, task = along.verdict.robot, along.cells, along.verdict.task
    if not along.verdict.feasible:
        return False
    run = trajectory(coverage_path(along.verdict), SPEED)
    for q, cell in ((along.verdict.witness.q, along.verdict.witness.cell), (run.q, run.cell)):
        found = verify(robot, cells, task, q, working=cells.surface.works(cell))
        assert found.holds, found.refusal
        assert max(worst(case, q, cell)) <= ROUNDING
    return True


@pytest.mark.parametrize("number", SAMPLE)
def test_what_is_called_feasible_is_right_over_the_surface(number: int) -> None:
    assert_holds(number)
