"""5e with its surface as a wall; more of the paper's cases: `make campaign NAME=paper_walls`."""

from __future__ import annotations

from foreign_clearances import assert_clear
from paper_cases import PAPER_CASES

from feasibility import Answer, Evidence, check
from feasibility.collisions import Collision


def test_a_motion_before_the_wall_is_found_and_right() -> None:
    """Without collisions the motion reaches through the wall; there is another one."""
    case = PAPER_CASES["5e"]
    found = check(case.robot(), case.cells(), case.task(), collision=Collision(clearance=0.005))
    assert (found.answer, found.evidence) == (Answer.FEASIBLE, Evidence.WITNESS)
    assert_clear(found, 2.0)
