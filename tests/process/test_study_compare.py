"""`study` and `compare` as they are typed: each row is what the arm's own `check` says."""

from __future__ import annotations

import csv
import io
import itertools
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from jobs import PLATE, coverable

from feasibility import check
from feasibility.cases import Case, CaseError, load_case
from feasibility.division import divide
from feasibility.reports.study_plot import charts
from feasibility.studies import Row, compare, open_workers, read_study

STRIP = PLATE.replace("[0.4, 0.6]", "[0.3, 0.7]").replace("[3, 4]", "[4, 2]")
STRIP = STRIP.replace("[0, 0, 0.3]", "[0, 0, 0.2]") + "search.seed = 4\n"
ROBOTS = ("ur3", "ur5", "puma560", "xarm7")  # of these ur3 misses a part


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder with a case and a study, where the commands run."""
    (tmp_path / "strip.toml").write_text(STRIP)
    (tmp_path / "study.toml").write_text(
        'base.case = "strip.toml"\nvary.robots = ["ur5", "ur3"]\n'
        'vary."surface.position".x = [-0.1, 0.0, 2.0]\n'
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


def table_of(file):
    """The rows of a CSV file."""
    return list(csv.DictReader(io.StringIO(file.read_text(encoding="utf-8"))))


def verdict_of(robot, *settings):
    """What `check` says, of a case that is built by itself."""
    setup = load_case("strip.toml", [f"robot.name={robot}", *settings]).build()
    return setup, check(*setup)


def test_compare_says_of_each_arm_what_check_and_divide_say(folder) -> None:
    said = coverable(
        "compare", "strip.toml", "--robots", ", ".join(ROBOTS), "--workers", 0, "--json",
        "--csv", "a.csv", "--html", "a.html",
    )  # fmt: skip
    assert said.status == 0
    told, lines = json.loads(said.out), table_of(folder / "a.csv")
    assert [arm["robot"] for arm in told["robots"]] == list(ROBOTS)
    for arm, line in zip(told["robots"], lines, strict=True):
        setup, verdict = verdict_of(arm["robot"])
        assert (arm["verdict"], arm["message"]) == (str(verdict.answer), verdict.message)
        assert (arm["cells"], arm["covered"]) == (8, verdict.n_covered)
        assert arm["share"] == pytest.approx(verdict.n_covered / 8) == float(line["share"])
        assert (arm["joints"], arm["reach_m"]) == (setup.robot.n, pytest.approx(setup.robot.reach))
        assert (arm["margins"] is not None) == (arm["cause"] is None) == verdict.feasible
        division = divide(*setup)
        assert arm["patches"] == len(division.patches)
        assert arm["patches_share"] == pytest.approx(division.n_covered / 8)
        assert line["verdict"] == arm["verdict"]
    assert {arm["verdict"] for arm in told["robots"]} == {"feasible", "infeasible"}
    # The best comes first.
    rank = {arm["robot"]: arm for arm in told["robots"]}
    best = [rank[name] for name in told["ranking"]]
    order = [((arm["margins"] or {}).get("limit_deg", -1.0), arm["share"]) for arm in best]
    assert order == sorted(order, reverse=True)


CELL = 'robot.base.position = [0, 0, 0.1]\nrobot.axis = [{ name = "table", type = "revolute", ' + (
    'carries = "surface", limits_deg = [-9, 9] }]\n'
)
NOZZLE = "robot.tcp = { position = [0.02, 0, 0.08], rpy_deg = [0, 30, 0] }\n"


@pytest.mark.parametrize("more", [CELL, NOZZLE + "robot.approach_axis = [0, 0, 1]\n"])
def test_other_arms_stand_in_the_same_cell_with_the_same_tool(more, tmp_path) -> None:
    case = Case.from_toml(STRIP + more, name="cell")
    other = Case.from_toml(STRIP.replace("ur5", "ur10") + more).build()
    with open_workers(0) as workers:
        arm = compare(case, ["ur5", "ur10"], workers, divide=False).arms[1]
        verdict = check(*other)
        assert (arm.message, arm.joints) == (verdict.message, other.robot.n)
        assert arm.covered == verdict.n_covered
        if more is not CELL:  # a tool whose numbers would point elsewhere on this flange
            with pytest.raises(CaseError, match=r"robots\[1\].*tcp does not fit"):
                compare(case, ["ur5", "kinova"], workers)
            (tmp_path / "nozzle.toml").write_text(STRIP + more)
            with pytest.raises(CaseError, match=r"kinova has a tool frame.*tcp does not fit"):
                read_study('base.case = "nozzle.toml"\nvary.robots = ["kinova"]', tmp_path)


@pytest.mark.parametrize(
    ("name", "z", "turns", "given"), [("puma560", 0.2, 3, 12.0), ("ur3", 0.4, 19, 12.0)]
)
def test_the_critical_cone_is_where_the_verdict_turns(name, z, turns, given) -> None:
    """At the cone that is named there is a motion; half a degree below none is found."""
    settings = [f"robot.name={name}", "surface.u=[0.3, 0.5]", "surface.v=[-0.05, 0.05]",
                "surface.cells=[2, 1]", f"task.cone_deg={given}",
                f"surface.position=[0, 0, {z}]"]  # fmt: skip
    case = load_case("strip.toml", settings)
    robot, cells, task, search, *_ = case.build()
    with open_workers(0) as workers:
        (arm,) = compare(case, [name], workers, critical=True).arms
    cone = arm.critical_cone_deg
    assert cone == pytest.approx(turns, abs=1.0)
    assert (arm.verdict == "feasible") == (cone <= given)
    assert check(robot, cells, replace(task, cone_deg=cone), search).feasible
    if cone > 3.0:
        assert not check(robot, cells, replace(task, cone_deg=cone - 0.5), search).feasible


def test_each_row_of_a_study_is_what_check_says_and_is_decided_once(folder) -> None:
    files = "--out", "s.study", "--csv", "s.csv", "--workers", 0
    said = coverable("study", "study.toml", *files, "--json")
    assert said.status == 0
    told, lines = json.loads(said.out), table_of(folder / "s.csv")
    assert told["tasks"] == len(told["rows"]) == 6
    count = dict.fromkeys(("feasible", "infeasible", "undecided"), 0)
    for row, line in zip(told["rows"], lines, strict=True):
        name, x = (row["parameters"][key] for key in ("robot", "surface.position.x"))
        _, verdict = verdict_of(name, f"surface.position=[{x}, 0, 0.2]")
        assert (row["verdict"], row["covered"]) == (str(verdict.answer), verdict.n_covered)
        assert (row["evidence"], row["message"]) == (str(verdict.evidence), verdict.message)
        assert (line["verdict"], float(line["share"])) == (row["verdict"], row["share"])
        count[row["verdict"]] += 1
        if x == 2.0:
            assert row["causes"] == {"out_of_reach": 8}
    assert told["verdicts"] == count
    assert min(count["feasible"], count["infeasible"]) > 0
    # Once more: nothing is left to do, and the table is the same to the last byte.
    before = (folder / "s.csv").read_bytes()
    seconds = [row["seconds"] for row in told["rows"]]
    again = coverable("study", "study.toml", *files, "--json")
    assert "6 finished cases" in again.err
    assert [row["seconds"] for row in json.loads(again.out)["rows"]] == seconds
    assert (folder / "s.csv").read_bytes() == before
    # A run that is refused leaves files as they were.
    (folder / "bad.toml").write_text((folder / "study.toml").read_text() + "extra = 1")
    kept = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert "extra" in coverable("study", "bad.toml", *files).err
    assert coverable("study", "study.toml", "--out", "strip.toml").status == 2
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == kept


def test_maps_show_the_best_of_each_field_and_leave_out_what_failed() -> None:
    """Every number written into a map against a maximum taken by hand, one map for each arm."""
    values = {"robot": ["ur5", "<b>"], "a": [1, 2, 3], "b": [0.5, 0.7], "c": [4, 9]}
    rng, rows = np.random.default_rng(3), []
    for row in itertools.product(*values.values()):
        result = {"verdict": "infeasible", "share": float(rng.uniform(0.0, 0.9999))}
        if rng.random() < 0.1:
            result = {"verdict": "undecided", "evidence": "budget", "message": "died"}
        rows.append(Row(dict(zip(values, row, strict=True)), "done", result, 0.1))
    drawn = iter(charts(list(values), rows).drawn[3:])
    for (x, y), arm in itertools.product(itertools.combinations("abc", 2), values["robot"]):
        written = re.findall(r'<text style="font-size: 8px[^>]*>(\d+)</text>', next(drawn).svg)
        best = [
            max(
                100 * row.result.get("share", -1.0) for row in rows
                if row.parameters["robot"] == arm
                and (row.parameters[x], row.parameters[y]) == (i, j)
            )
            for j in values[y] for i in values[x]
        ]  # fmt: skip
        assert written == [str(math.floor(share)) for share in best]
