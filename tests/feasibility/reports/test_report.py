"""Reports: the JSON keeps the contract, the text says the answer first, the CSV is one motion."""

import csv
import json
import math
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from schema import CHECK, conforms
from small_cases import TEXTS, empty_verdict, paper_verdict, small_case, small_verdict

from feasibility import check
from feasibility.cases import load_case
from feasibility.reports.verdict import as_csv, as_json, as_text
from feasibility.verdict import Answer, Cause, CauseKind, Certificate, Evidence, Verdict, Walk
from robots import Robot, load_robot
from surfaces import Cells


def parsed(verdict: Verdict, **options: float) -> dict:
    """What a reader of the JSON sees."""
    return json.loads(json.dumps(as_json(verdict, **options), allow_nan=False))


@pytest.mark.parametrize("name", TEXTS)
def test_json_keeps_the_contract(name):
    verdict = small_verdict(name)
    found = parsed(verdict)
    conforms(found, CHECK)
    assert found["cells"] == len(verdict.cells)
    assert found["covered"] == found["cells"] - len(found["uncovered"])
    assert found["edges"] == verdict.graph.number_of_edges()


def test_json_of_a_feasible_case():
    verdict = paper_verdict("4a")
    found = parsed(verdict, before_s=1.5)
    assert (found["verdict"], found["evidence"]) == ("feasible", "witness")
    assert (found["cells"], found["covered"], found["edges"]) == (90, 90, 305)
    assert found["uncovered"] == []
    certificate, replayed = found["certificate"], verdict.certificate
    assert certificate["waypoints"] == replayed.waypoints == len(verdict.witness.q)
    assert certificate["max_position_error_m"] == replayed.max_position_error <= 0.001
    assert certificate["max_angle_deg"] == pytest.approx(math.degrees(replayed.max_angle))
    margin = math.degrees(replayed.min_limit_margin)
    assert certificate["min_limit_margin_deg"] == pytest.approx(margin)
    timing = found["timing"]
    assert timing["load_s"] == pytest.approx(verdict.timing["load_s"] + 1.5, abs=1e-6)
    assert timing["search_s"] == pytest.approx(verdict.timing["search_s"], abs=1e-6)
    parts = timing["load_s"] + timing["search_s"] + timing["certify_s"]
    # What passes between the parts counts too; a machine may take its time there.
    assert timing["total_s"] == pytest.approx(verdict.timing["total_s"] + 1.5, abs=1e-6)
    assert timing["total_s"] >= parts - 1e-5


def test_json_names_every_uncovered_cell_by_its_two_indices():
    found = parsed(paper_verdict("4d"))
    conforms(found, CHECK)
    assert (found["verdict"], found["evidence"], found["covered"]) == ("infeasible", "proof", 60)
    assert [row["cell"] for row in found["uncovered"]] == [
        [i, j] for i in range(6, 9) for j in range(10)
    ]
    assert {row["cause"] for row in found["uncovered"]} == {"joint_limits"}


def test_json_has_no_nan_where_joints_have_no_limits():
    verdict = small_verdict("plate")
    free = replace(verdict.certificate, min_limit_margin=math.inf)
    found = parsed(replace(verdict, certificate=free))
    conforms(found, CHECK)
    assert found["certificate"]["min_limit_margin_deg"] is None


def test_the_margin_in_degrees_is_that_of_turning_joints():
    text = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
      <joint name="slide" type="prismatic"><parent link="a"/><child link="b"/>
      <axis xyz="1 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
      <joint name="turn" type="revolute"><parent link="b"/><child link="c"/>
      <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
    verdict = small_verdict("plate")
    walk = Walk(np.array([[0.001, 0.0], [0.5, 0.4]]), np.array([0, 1]))
    slider = replace(
        verdict,
        robot=_arm(text),
        witness=walk,
        certificate=Certificate(2, 0.0, 0.0, min_limit_margin=0.001),
    )
    margin = parsed(slider)["certificate"]["min_limit_margin_deg"]
    assert margin == pytest.approx(math.degrees(0.6))


def _arm(text: str) -> Robot:
    """The robot of a URDF text."""
    from urdf_texts import check_urdf_text

    from robots.pinocchio_model import robot_from_urdf

    return robot_from_urdf(check_urdf_text(text), name="r")


def verdict_of(answer, evidence, causes=(), method="complete"):
    """A verdict over 3 x 4 cells that misses the cells of the causes."""
    robot, cells, task, _ = small_case("plate").build()
    covered = np.ones(len(cells), dtype=bool)
    covered[[cause.cell for cause in causes]] = False
    graph = nx.Graph()
    graph.add_nodes_from(range(len(cells)), q=None)
    return Verdict(
        answer, evidence, "Said so.", robot, cells, task, method, 0, graph, covered, tuple(causes)
    )


def missed(kind, cells, proved=False):
    return [Cause(cell, kind, proved, f"detail {cell}") for cell in cells]


def test_text_says_the_answer_first_and_what_it_rests_on():
    text = as_text(small_verdict("plate"), small_case("plate"))
    assert text.startswith("feasible: one continuous motion covers the whole surface.\n")
    for words in ("12 of 12 cells", "29 of 29", "witness: ", "waypoints", "mm", "deg", "--witness"):
        assert words in text
    assert "Not covered" not in text


def test_text_groups_the_causes():
    causes = [
        *missed(CauseKind.JOINT_LIMITS, range(5), proved=True),
        *missed(CauseKind.ORIENTATION, [7]),
    ]
    text = as_text(verdict_of(Answer.INFEASIBLE, Evidence.PROOF, causes), small_case("plate"))
    assert text.startswith("infeasible: no single continuous motion")
    lines = text.splitlines()
    at = lines.index("Not covered:")
    assert lines[at + 1 : at + 8] == [
        "  5 cells: joint limits, proved",
        "    [0, 0] detail 0",
        "    [0, 1] detail 1",
        "    [0, 2] detail 2",
        "    ... and 2 more (--json lists all)",
        "  1 cell: orientation (the tool cannot be held as required)",
        "    [1, 3] detail 7",
    ]
    hints = text[text.index("To try next:") :]
    assert "task.cone_deg" in hints
    assert "robot.limits" in hints


@pytest.mark.parametrize("kind", CauseKind)
def test_every_cause_has_its_words(kind):
    verdict = verdict_of(Answer.INFEASIBLE, Evidence.EXHAUSTED, missed(kind, [3]))
    assert "  1 cell: " in as_text(verdict, small_case("plate"))
    assert parsed(verdict)["uncovered"] == [
        {"cell": [0, 3], "cause": kind.value, "proved": False, "detail": "detail 3"}
    ]


def test_the_no_of_the_greedy_search_is_its_own():
    verdict = verdict_of(Answer.INFEASIBLE, Evidence.EXHAUSTED, method="greedy")
    text = as_text(verdict, small_case("plate"))
    assert text.startswith("infeasible: not found by the greedy search")
    assert "search.method=complete" in text


def test_undecided_asks_for_time_where_time_ran_out():
    late = load_case("paper/4d", ["search.time_limit=1e-6"])
    text = as_text(check(*late.build()), late)
    assert text.startswith("undecided: ")
    assert "search.time_limit" in text
    stiff = load_case("paper/4a", ["task.cone_deg=0"])
    text = as_text(check(*stiff.build()), stiff)
    assert text.startswith("undecided: ")
    assert "search.time_limit" not in text


@pytest.mark.parametrize(
    ("name", "offered", "others"),
    [
        ("paper/4a", ["coverable path", "coverable explain"], ["coverable divide"]),
        ("paper/4d", ["coverable explain", "coverable divide"], ["coverable path"]),
    ],
)
def test_the_next_commands(name, offered, others):
    case = load_case(name)
    text = as_text(check(*case.build()), case)
    assert all(command in text for command in offered)
    assert not any(command in text for command in others)


def rows_of(text):
    header, *rows = csv.reader(text.splitlines())
    cells = [None if row[0] == "" else int(row[0]) for row in rows]
    return header, cells, np.array([[float(value) for value in row[1:]] for row in rows])


@pytest.mark.parametrize("name", ["4a", "5f"])
def test_the_csv_is_one_motion_over_every_cell_centre(name):
    verdict = paper_verdict(name)
    text = as_csv(verdict)
    header, at, q = rows_of(text)
    robot: Robot = load_robot("puma560", limits="set-1")
    cells: Cells = load_case(f"paper/{name}").build().cells
    assert header == ["cell", *robot.joint_names]
    assert np.array_equal(q, verdict.witness.q)  # every digit is there
    assert {cell for cell in at if cell is not None} == set(range(90))
    from robots import Kinematics

    kinematics, targets = Kinematics(robot), verdict.task.targets(cells)
    for cell, row in zip(at, q, strict=True):
        assert (robot.lower <= row).all()
        assert (row <= robot.upper).all()
        if cell is not None:
            point, axis = kinematics.tool(row)
            assert np.linalg.norm(point - targets.points[cell]) <= 1e-3
            angle = math.acos(min(1.0, axis @ targets.approaches[cell]))
            assert angle <= verdict.task.cone + 1e-9
    assert text.endswith("\n")
    assert "\r" not in text


def test_there_is_no_csv_without_a_motion():
    assert as_csv(small_verdict("long plate")) is None
    assert as_csv(empty_verdict()) is None


def test_a_verdict_over_no_cells_says_so_first():
    text = as_text(empty_verdict(), small_case("plate"))
    assert text.startswith("feasible: there are no cells, so there is nothing to cover")
    assert "motion" not in text
    assert "there is nothing to cover" in repr(empty_verdict())
