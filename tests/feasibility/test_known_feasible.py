"""Cases that are known to be feasible, some of them once answered wrongly: all have a witness."""

from functools import cache

import pytest
from dense_replay import assert_witness
from draw_between_curves import read_between
from draw_disconnected import read_apart
from oracle_build import built
from planted import HERE, read_planted
from widening import WIDENINGS, case_of, decided, lost, widened

from feasibility import Answer, Search, check
from feasibility.cases import load_case
from robots import load_robot

SHARED = sorted(path.stem for path in (HERE / "shared_cases").glob("*.toml"))


def assert_feasible(*setup):
    verdict = check(*setup)
    assert verdict.feasible, verdict
    assert_witness(verdict)


@pytest.mark.parametrize("name", SHARED)
def test_a_case_that_was_once_called_infeasible(name):
    path = HERE / "shared_cases" / f"{name}.toml"
    assert_feasible(*load_case(path, ["search.seed=3"]).build())


@pytest.mark.parametrize("number", range(0, 100, 25))
def test_what_only_the_tolerance_reaches_is_covered(number):
    assert_feasible(*read_planted("tolerance_needed")[number].setup())


@pytest.mark.parametrize("number", range(0, 110, 40))
def test_a_narrow_cone_is_no_obstacle(number):
    assert_feasible(*read_planted("narrow_cones")[number].setup())


@pytest.mark.parametrize("number", [0, 2])
def test_the_way_between_the_curves_is_found(number):
    setup = built(read_between()[number].problem, load_robot("puma560"))
    assert_feasible(*setup, Search())


@cache
def narrow(number):
    return decided(case_of(number)[0])


@pytest.mark.parametrize("what", WIDENINGS)
@pytest.mark.parametrize("number", [1, 2, 9])
def test_what_is_wider_loses_nothing_whatever_the_arm(number, what):
    tables, rng = case_of(number)
    assert lost(narrow(number), decided(widened(rng, tables, what))) == ""


def test_a_passage_too_narrow_to_be_found_is_not_called_infeasible():
    """The oracle's motion goes round the border of the arm's reach, with 0.003 deg to the cone."""
    case = read_apart("puma560")[61]
    assert case.tight_feasible
    assert check(*built(case.problem, load_robot("puma560"))).answer is not Answer.INFEASIBLE
