"""The treated share of certified motions, and what a demanded coverage makes of an answer."""

from __future__ import annotations

import json

import numpy as np
import pytest
from dense_replay import dense

from coverable_errors import CoverableError
from feasibility import Answer, Task, check
from feasibility.cases import CaseError, load_case
from feasibility.cli.main import main
from feasibility.treated import Decision, with_coverage
from feasibility.verdict import Evidence
from robots import Kinematics, load_robot
from surfaces import plane, poses
from surfaces.passes import ToolLines, visits

UR5 = load_robot("ur5")
PLATE = plane((0.0, 0.3), (0.0, 0.2), "outside", (0.4, -0.1, 0.2))
CELLS = PLATE.cells(3, 2)
TASK = Task(standoff=0.02, cone_deg=20, footprint=0.08)


@pytest.fixture(scope="module")
def found():
    return check(UR5, CELLS, TASK)


def dense_share(verdict, radius: float) -> float:
    """By other code: points drawn by area, distance by brute force to twenty places a segment."""
    q = verdict.witness.q
    feet = Kinematics(UR5).tools(dense(q))[0][:, :2]
    drawn = np.random.default_rng(4).uniform([0.4, -0.1], [0.7, 0.1], (40_000, 2))
    squared = np.full(len(drawn), np.inf)
    for some in np.array_split(feet, 20):
        away = ((drawn[:, None] - some[None]) ** 2).sum(axis=2).min(axis=1)
        squared = np.minimum(squared, away)
    return float((squared <= radius**2).mean())


def test_the_share_of_a_witness_agrees_with_points_drawn_by_area(found) -> None:
    treated = found.treated
    drawn = dense_share(found, 0.04)
    assert treated.area == pytest.approx(0.06)
    assert treated.upper - treated.lower <= 0.006
    assert treated.lower - 0.007 <= drawn <= treated.upper + 0.007  # 4 standard errors: 0.009
    assert 0.0 < treated.twice < treated.upper
    assert treated.lower < 0.99


def test_regions_are_the_rest_and_lie_off_the_path(found) -> None:
    treated = found.treated
    left = sum(each.area for each in treated.untreated) / treated.area
    assert left == pytest.approx(1.0 - treated.upper, abs=0.004)
    feet = treated.lines.points
    for each in treated.untreated:
        assert np.linalg.norm(feet - each.centre, axis=1).min() > 0.04 - 0.02
    sizes = [each.area for each in treated.untreated]
    assert sizes == sorted(sizes, reverse=True)


def test_a_footprint_changes_neither_verdict_nor_search(found) -> None:
    alone = check(UR5, CELLS, Task(standoff=0.02, cone_deg=20))
    assert (alone.answer, alone.message) == (found.answer, found.message)
    assert alone.statistics == found.statistics
    assert np.array_equal(alone.witness.q, found.witness.q)
    assert alone.treated is None


def test_coverage_decides_by_the_lower_end(found) -> None:
    low, high = found.treated.lower, found.treated.upper
    for asked, answer in ((low - 1e-6, "feasible"), (low + 1e-6, "undecided"), (1.0, "undecided")):
        task = Task(standoff=0.02, cone_deg=20, footprint=0.08, coverage=asked)
        verdict = check(UR5, CELLS, task)
        assert str(verdict.answer) == answer
        assert (verdict.witness is None) == (answer == "undecided")
        assert verdict.treated.lower == low
        assert verdict.covered.all()
    assert f"{100 * high:.1f}"[:3] in verdict.message
    proof = Decision(Answer.INFEASIBLE, Evidence.PROOF, "It is proved.")
    assert with_coverage(proof, task, None) == proof


def test_an_ellipse_lies_between_its_discs() -> None:
    shares = {}
    for footprint in (0.05, 0.08, (0.05, 0.08), (0.08, 0.05)):
        task = Task(standoff=0.02, cone_deg=20, footprint=footprint)
        shares[footprint] = check(UR5, CELLS, task).treated
    for ellipse in ((0.05, 0.08), (0.08, 0.05)):
        assert shares[ellipse].lower == shares[0.05].lower
        assert shares[ellipse].upper == shares[0.08].upper


def test_automatic_cells_are_fine_enough() -> None:
    """On a panel and over a dome every place is treated by a tool that visits the centres."""
    case = load_case("paper/4a", ["surface.cells=auto", "task.footprint=0.4"])
    verdict = check(*case.build())
    assert verdict.feasible
    assert verdict.treated.lower >= 0.999
    assert case.from_toml(case.to_toml()) == case
    assert case.surface.is_grid
    with pytest.raises(CaseError, match=r"makes .* cells"):
        load_case("paper/4a", ["surface.cells=auto", "task.footprint=1e-3"]).build()


def test_between_poses_nothing_can_be_treated() -> None:
    cells = poses([[0.4, 0.0, 0.2], [0.5, 0.0, 0.2]], [[0, 0, 1], [0, 0, 1]])
    with pytest.raises(CoverableError, match="no surface to treat"):
        check(UR5, cells, TASK)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (["task.footprint=0"], "footprint: must be a finite number > 0"),
        (["task.footprint=[0.1, -0.1]"], "footprint: must be a diameter > 0"),
        (["task.footprint=0.1", "task.coverage=1.2"], "coverage: must be a share above 0"),
        (["task.coverage=0.9"], "needs a footprint"),
        (["surface.cells=auto"], "without a footprint"),
    ],
)
def test_bad_numbers_are_named(settings, said) -> None:
    with pytest.raises(CaseError) as raised:
        load_case("paper/4a", settings).build()
    assert said in str(raised.value)
    assert len(raised.value.faults) == 1


def test_the_command_says_what_is_treated(capsys) -> None:
    asked = ["paper/4a", "--set", "task.footprint=0.25"]
    assert main(["check", *asked, "--json"]) == 0
    treated = json.loads(capsys.readouterr().out)["treated"]
    assert treated["lower"] <= treated["upper"] < 0.99
    assert treated["footprint_m"] == [0.25, 0.25]
    assert len(treated["untreated"][0]["centre"]) == 3
    assert main(["check", *asked, "--set", "task.coverage=0.99"]) == 3
    said = " ".join(capsys.readouterr().out.split())
    assert "not shown to treat enough" in said
    assert "surface.cells=auto" in said
    few = ["--set", "surface.cells=[2, 2]"]
    assert main(["check", "paper/4a", "--set", "task.footprint=9", *few]) == 0
    assert "larger than the whole surface" in " ".join(capsys.readouterr().out.split())


def test_with_a_footprint_the_answer_begins_with_what_is_treated(capsys) -> None:
    """And says how to treat more of it, where that is not nearly all."""
    asked = ["check", "paper/4a", "--set", "surface.cells=[4, 5]", "--set", "task.footprint=0.3"]
    assert main(asked) == 0
    head, *rest = capsys.readouterr().out.splitlines()
    treats = "feasible: one continuous motion visits every cell and treats {} of the area.".format
    (share,) = (line.split(" of ")[0] for line in rest if line.startswith("  treated"))
    assert head == treats(share.removeprefix("  treated").strip())
    offered = " ".join(rest)
    for remedy in ("surface.cells=auto", "task.coverage=0.99", "path --passes best --pitch 0.27"):
        assert remedy in offered
    assert main([*asked, "--set", "surface.cells=auto"]) == 0
    fine = capsys.readouterr().out
    assert fine.startswith(treats("100.00 %"))
    assert not any(word in fine for word in ("cells=auto cuts", "coverage=0", "--pitch"))


def test_visits_are_counted_by_coming_and_going() -> None:
    rows = [np.linspace((-0.05, y, 0.0), (0.65, y, 0.0), 200) for y in (0.1, 0.14)]
    normals = np.tile([0.0, 0.0, 1.0], (400, 1))
    path = ToolLines(np.concatenate(rows), normals, np.repeat([0, 1], 200))
    places = np.array([[0.3, 0.08, 0.0], [0.3, 0.12, 0.0], [0.3, 0.2, 0.0], [0.3, 0.15, 0.0]])
    up = np.tile([0.0, 0.0, 2.0], (4, 1))
    assert visits(places, up, path, 0.03).tolist() == [1, 2, 0, 1]
    assert visits(places, -up, path, 0.03).tolist() == [0, 0, 0, 0]
    back = ToolLines(np.concatenate([rows[0], rows[0][::-1]]), normals, np.zeros(400, dtype=int))
    assert visits(np.array([[0.6, 0.1, 0.0]]), up[:1], back, 0.03).tolist() == [2]
