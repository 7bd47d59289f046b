"""Random problems that fall apart with every cell in reach: most are proved, none wrongly."""

import pytest
from draw_disconnected import read_apart
from oracle_build import built
from tally import Tally

from feasibility import CauseKind, check
from feasibility.verdict import Answer, Evidence
from robots import load_robot


def has_uncoverable_cell(verdict):
    """Whether a single cell is proved to be beyond the arm."""
    return any(
        cause.proved and cause.kind is not CauseKind.DISCONNECTED for cause in verdict.causes
    )


@pytest.mark.parametrize(
    ("arm", "least_count", "least_proved"),
    [("puma560", 100, 0.95), ("ur5", 50, 0.90), ("panda", 30, 0.50)],
)
def test_most_are_proved(arm, least_count, least_proved):
    robot, found, wrong, doubtful, counted = load_robot(arm), Tally(), [], [], Tally()
    for number, case in enumerate(read_apart(arm)):
        verdict = check(*built(case.problem, robot))
        found.add(str(number), verdict)
        if verdict.answer is Answer.INFEASIBLE and case.tight_feasible:
            wrong.append((number, verdict.evidence))
        if verdict.feasible and case.wide_feasible is False:
            doubtful.append(number)
        if not verdict.feasible and not has_uncoverable_cell(verdict):
            counted.add(str(number), verdict)
    print(f"{arm}, all\n{found.table()}\nnot feasible, no uncoverable cell\n{counted.table()}")
    print("not proved:", [row for row in counted.rows if row[2] != Evidence.PROOF])
    print("feasible, while the oracle sees none even if wider:", doubtful)
    assert wrong == []
    assert len(counted.rows) >= least_count
    proved = sum(evidence == Evidence.PROOF for _, _, evidence, _ in counted.rows)
    assert proved >= least_proved * len(counted.rows)
