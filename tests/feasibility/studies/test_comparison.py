"""Arms compared: each row is what the arm's own verdict says; the tables say what the rows say."""

from __future__ import annotations

import csv
import io
import json
import re
import xml.etree.ElementTree as ET
from argparse import Namespace
from dataclasses import replace
from html.parser import HTMLParser
from shutil import copyfile

import pytest
import study_works
from small_cases import TEXTS, small_case

from feasibility import check
from feasibility.cases import Case, load_case
from feasibility.cases.case import CaseError
from feasibility.cli.main import main
from feasibility.cli.study_compare import compare as compare_command
from feasibility.cli.study_compare import study as study_command
from feasibility.division import divide
from feasibility.reports.comparison import as_csv, as_html, as_json, as_text, chart, columns
from feasibility.reports.study import as_csv as study_csv
from feasibility.reports.study import as_text as study_text
from feasibility.studies import Arm, Comparison, Row, compare, open_workers
from feasibility.studies.file import read_study
from feasibility.studies.robot_comparison import CONE_STEP_DEG, _tables_of, critical_cone
from robots import list_robots

ROBOTS = ("ur3", "ur5", "puma560", "xarm7")

# Long enough that ur3 and some others miss a part of it.
STRIP = """
    robot = { name = "puma560", limits = "set-1" }
    surface.kind = "plane"
    surface.u = [0.3, 0.7]
    surface.v = [-0.1, 0.1]
    surface.cells = [4, 2]
    surface.position = [0, 0, 0.2]
    surface.side = "outside"
    task = { standoff = 0.02, cone_deg = 30 }
    search.seed = 4
"""


@pytest.fixture(scope="module")
def strip():
    return Case.from_toml(STRIP, name="strip")


@pytest.fixture(scope="module")
def compared(strip):
    with open_workers(0) as workers:
        return compare(strip, ROBOTS, workers)


CELL = """
    base = { position = [0, 0, 0.1] }
    axis = [{ name = "table", type = "revolute", carries = "surface", limits_deg = [-9, 9] }]
"""


def test_other_arms_stand_in_the_same_cell() -> None:
    """The base and the axes are the cell's: another arm gets them, and the part stands on them."""
    of_robot = f'[robot]\nname = "ur3"{CELL}'
    rest = STRIP.partition("\n    robot")[2].partition("\n")[2]
    case = Case.from_toml(f"{rest}{of_robot}", name="cell")
    other = Case.from_toml(f"{rest}{of_robot.replace('ur3', 'ur5')}").build()
    with open_workers(0) as workers:
        found = compare(case, ["ur3", "ur5"], workers, divide=False)
    assert [arm.joints for arm in found.arms] == [7, 7]
    verdict = check(other.robot, other.cells, other.task, other.search)
    assert found.arms[1].message == verdict.message
    assert found.arms[1].covered == int(verdict.covered.sum()) > 0


NOZZLE = "tcp = { position = [0.02, 0, 0.08], rpy_deg = [0, 30, 0] }\n    approach_axis = [0, 0, 1]"


def test_other_arms_carry_the_same_tool(tmp_path) -> None:
    rest = STRIP.partition("\n    robot")[2].partition("\n")[2]
    given = f'{rest}[robot]\nname = "ur3"\n{NOZZLE}\n'
    case = Case.from_toml(given, name="nozzle")
    (tables,) = _tables_of(case, ["ur5"])
    assert tables["robot"]["name"] == "ur5"
    assert tables["robot"]["tcp"] == {"position": [0.02, 0, 0.08], "rpy_deg": [0, 30, 0]}
    assert tables["robot"]["approach_axis"] == [0, 0, 1]
    with pytest.raises(CaseError, match=r"robots\[1\].*points along \[1, 0, 0\].*tcp does not fit"):
        _tables_of(case, ["ur5", "kinova"])
    study = 'base.case = "nozzle.toml"\nvary.robots = ["ur5", "kinova"]'
    (tmp_path / "nozzle.toml").write_text(given)
    with pytest.raises(CaseError, match=r"kinova has a tool frame.*tcp does not fit"):
        read_study(study, tmp_path)


def test_a_greedy_case_is_compared_by_the_complete_search_in_the_same_time() -> None:
    settings = ["search.method=greedy", "search.step_deg=1", "search.seed=3", "search.time_limit=5"]
    (tables,) = _tables_of(load_case("paper/4a", settings), ["ur5"])
    assert tables["search"] == {"seed": 3, "time_limit": 5.0}


def test_each_arm_says_what_its_verdict_says(strip, compared) -> None:
    assert [arm.robot for arm in compared.arms] == list(ROBOTS)
    verdicts = {arm.verdict for arm in compared.arms}
    assert verdicts == {"feasible", "infeasible"}
    for arm in compared.arms:
        settings = [] if arm.robot == "puma560" else [f"robot.name={arm.robot}", "robot.limits="]
        setup = strip.with_overrides(settings).build()
        verdict = check(*setup)
        assert (arm.verdict, arm.message) == (str(verdict.answer), verdict.message)
        assert (arm.cells, arm.covered) == (8, verdict.n_covered)
        assert arm.share == pytest.approx(verdict.n_covered / 8)
        assert (arm.joints, arm.reach_m) == (setup.robot.n, pytest.approx(setup.robot.reach))
        assert (arm.margins is not None) == verdict.feasible
        assert (arm.cause is None) == verdict.feasible
        division = divide(*setup)
        assert arm.patches == len(division.patches)
        assert arm.patches_share == pytest.approx(division.n_covered / 8)
        assert arm.critical_cone_deg is None


def test_the_best_comes_first(compared) -> None:
    ranked = compared.ranked
    assert sorted(arm.robot for arm in ranked) == sorted(ROBOTS)
    able = [arm.verdict == "feasible" for arm in ranked]
    assert able == sorted(able, reverse=True)
    margins = [arm.margins["limit_deg"] for arm in ranked if arm.margins]
    assert margins == sorted(margins, reverse=True)
    shares = [arm.share for arm in ranked if arm.verdict != "feasible"]
    assert shares == sorted(shares, reverse=True)


def test_workers_change_nothing(strip, compared) -> None:
    with open_workers(1) as workers:
        again = compare(strip, ROBOTS[:2], workers)
    for arm, other in zip(compared.arms[:2], again.arms, strict=True):
        assert replace(arm, seconds=0.0) == replace(other, seconds=0.0)


def test_an_arm_whose_worker_dies_is_undecided(strip, monkeypatch) -> None:
    monkeypatch.setattr("feasibility.studies.robot_comparison.assess", study_works.fail_odd)
    with open_workers(0) as workers:
        (arm,) = compare(strip, ["ur5"], workers).arms
    assert (arm.robot, arm.verdict, arm.evidence) == ("ur5", "undecided", "budget")
    assert (arm.joints, arm.share, arm.covered) == (6, 0.0, 0)
    assert "KeyError" in arm.message


@pytest.mark.parametrize(
    ("name", "z", "turns", "given"),
    [("puma560", 0.2, 3, 12.0), ("ur3", 0.4, 19, 12.0), ("ur3", 0.4, 19, 95.25)],
)
def test_the_critical_cone_is_where_the_verdict_turns(strip, name, z, turns, given) -> None:
    """At the cone that is named there is a motion; a step below none is found."""
    settings = [f"robot.name={name}", "robot.limits=", "surface.u=[0.3, 0.5]",
                "surface.v=[-0.05, 0.05]", "surface.cells=[2, 1]", f"task.cone_deg={given}",
                f"surface.position=[0, 0, {z}]"]  # fmt: skip
    case = strip.with_overrides(settings)
    robot, cells, task, search = case.build()
    known = check(robot, cells, task, search).feasible
    cone = critical_cone(robot, cells, case, known)
    assert cone is not None
    assert known == (cone <= given)
    assert cone == pytest.approx(turns, abs=1.0)
    assert check(robot, cells, replace(task, cone_deg=cone), search).feasible
    if cone > 3.0:
        below = replace(task, cone_deg=cone - CONE_STEP_DEG)
        assert not check(robot, cells, below, search).feasible


def test_a_cone_that_no_width_helps() -> None:
    case = small_case("long plate").with_overrides(["surface.cells=[2, 1]"])
    robot, cells, _, _ = case.build()
    assert critical_cone(robot, cells, case, False) is None


def test_a_file_is_compared_with_an_arm_of_the_library(strip, tmp_path, monkeypatch) -> None:
    """Its path is taken from where the command runs, and names it in the answer."""
    monkeypatch.chdir(tmp_path)
    (urdf,) = (info.urdf for info in list_robots() if info.name == "ur5")
    copyfile(urdf, "my.urdf")
    with open_workers(0) as workers:
        ours, theirs = compare(strip, ["my.urdf", "ur5"], workers, divide=False).arms
        with pytest.raises(CaseError, match=r"robots\[0\].*no\.urdf"):
            compare(strip, ["no.urdf"], workers)
    assert ours.robot == "my.urdf"
    assert replace(ours, robot="ur5", seconds=0.0) == replace(theirs, seconds=0.0)


def test_arms_that_cannot_be_compared(strip) -> None:
    with open_workers(0) as workers:
        with pytest.raises(CaseError) as caught:
            compare(strip, ["ur55", "ur5", "ur5", "robby"], workers)
        places = [fault.key for fault in caught.value.faults]
        assert places == ["--robots[0]", "--robots[2]", "--robots[3]"]
        with pytest.raises(CaseError, match="is empty"):
            compare(strip, [], workers)
        with pytest.raises(CaseError, match="set-7"):
            compare(strip.with_overrides(["robot.limits=set-7"]), ["puma560"], workers)


# -- tables -----------------------------------------------------------------------------------


def test_json_and_csv_hold_every_number(compared) -> None:
    table = json.loads(json.dumps(as_json(compared), allow_nan=False))
    assert [Arm(**row) for row in table["robots"]] == list(compared.arms)
    rows = list(csv.DictReader(io.StringIO(as_csv(compared))))
    for row, arm in zip(rows, compared.arms, strict=True):
        assert row["robot"] == arm.robot
        assert float(row["share"]) == arm.share
        assert row["message"] == arm.message
        limit = (arm.margins or {}).get("limit_deg")
        assert row["margin_limit_deg"] == ("" if limit is None else str(limit))


def test_the_text_has_a_line_for_each_arm(compared) -> None:
    head, unchecked, empty, heads, dashes, *lines = as_text(compared).splitlines()
    assert unchecked.strip() == "collisions are not checked"
    able = [arm.robot for arm in compared.ranked if arm.verdict == "feasible"]
    assert head.endswith(": " + ", ".join(able))
    assert (empty, set(dashes)) == ("", {"-", " "})
    assert re.split(r"  +", heads) == [name for name, _ in columns(compared)]
    for line, arm in zip(lines, compared.ranked, strict=True):
        assert re.split(r"  +", line) == [say(arm) for _, say in columns(compared)]


class _Page(HTMLParser):
    """Cells of the table, and everything that a page could fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.cells: list[str] = []
        self.fetched: list[str] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag, attrs) -> None:
        self.tags.append(tag)
        self.fetched += [value for key, value in attrs if key in ("src", "href", "xlink:href")]

    def handle_data(self, data) -> None:
        if self.tags and self.tags[-1] == "td" and data.strip():
            self.cells.append(data)


def test_the_narrowest_cone_looked_at_is_a_bound(compared) -> None:
    """Feasible down to where the search for it stops: so no number is claimed to be the least."""
    for cone, said in ((3.0, "<= 3.0 deg"), (2.0, "<= 2.0 deg"), (3.5, "3.5 deg"), (None, "-")):
        arm = replace(compared.arms[0], critical_cone_deg=cone)
        told = replace(compared, arms=(arm,), critical=True)
        (cell,) = [say(arm) for heading, say in columns(told) if heading == "smallest cone"]
        assert cell == said
        assert said.replace("<", "&lt;") in as_html(told)


def test_the_page_stands_by_itself(compared) -> None:
    page = _Page()
    text = as_html(compared)
    page.feed(text)
    assert page.fetched == []
    assert "script" not in page.tags
    assert "url(" not in text
    assert page.cells == [say(arm) for arm in compared.ranked for _, say in columns(compared)]


def test_bars_are_as_long_as_shares(compared) -> None:
    bars = [float(e.attrib["width"]) for e in ET.fromstring(chart(compared)).iter("rect")]
    full = bars[0] / compared.ranked[0].share
    assert bars == pytest.approx([full * arm.share for arm in compared.ranked], abs=0.01)


def test_names_are_text_and_never_markup(compared) -> None:
    nasty = "<script>alert('x')</script>"
    arm = replace(compared.arms[0], robot=nasty, message=nasty)
    text = as_html(Comparison(nasty, (arm,), divided=True, critical=True))
    assert "<script" not in text
    assert "&lt;script&gt;" in text
    ET.fromstring(chart(Comparison(nasty, (arm,), divided=True, critical=True)))


# -- the commands -----------------------------------------------------------------------------


def arguments(**more) -> Namespace:
    plain = {"json": False, "csv": None, "html": None, "workers": 0, "dask": None, "settings": []}
    return (
        Namespace(**plain, critical=False)
        if not more
        else Namespace(**{**plain, "critical": False, **more})
    )


def test_compare_from_the_command_line(tmp_path, capsys) -> None:
    (tmp_path / "a.toml").write_text(TEXTS["plate"])
    files = {"csv": str(tmp_path / "a.csv"), "html": str(tmp_path / "a.html")}
    args = arguments(case=str(tmp_path / "a.toml"), robots="ur5, ur3", json=True, **files)
    assert compare_command(args, 0.0) == 0
    out, err = capsys.readouterr()
    table = json.loads(out)
    assert [row["robot"] for row in table["robots"]] == ["ur5", "ur3"]
    assert (tmp_path / "a.csv").read_text().startswith("robot,")
    assert (tmp_path / "a.html").read_text().startswith("<!doctype html>")
    assert err.count("\n") == 2


HALF_METRE = """
    robot = { name = "puma560", limits = "set-1" }
    surface.kind = "plane"
    surface.u = [-0.25, 0.25]
    surface.v = [-0.25, 0.25]
    surface.cells = [3, 3]
    surface.position = [0.45, 0, 0.2]
    surface.side = "outside"
    task = { standoff = 0.02, cone_deg = 30 }
"""
FLEET = ["puma560", "ur3", "ur5", "ur5_limited", "ur10", "ur10_limited", "panda", "kinova", "xarm7"]


def test_nine_arms_over_half_a_metre_in_one_command(tmp_path, capsys) -> None:
    """Each row is the arm's own verdict, and all but the smallest arm cover the patch."""
    (tmp_path / "a.toml").write_text(HALF_METRE)
    files = "--csv", str(tmp_path / "a.csv"), "--html", str(tmp_path / "a.html")
    names = "--robots", ",".join(FLEET)
    assert main(["compare", str(tmp_path / "a.toml"), *names, *files, "--workers", "0"]) == 0
    text = capsys.readouterr().out
    lines = {
        row["robot"]: row for row in csv.DictReader(io.StringIO((tmp_path / "a.csv").read_text()))
    }
    assert list(lines) == FLEET
    page = (tmp_path / "a.html").read_text()
    case = Case.from_toml(HALF_METRE)
    for name, row in lines.items():
        settings = [] if name == "puma560" else [f"robot.name={name}", "robot.limits="]
        verdict = check(*case.with_overrides(settings).build())
        assert row["verdict"] == str(verdict.answer)
        assert int(row["covered"]) == verdict.n_covered
        assert verdict.feasible == (name != "ur3")
        assert (float(row["margin_limit_deg"] or -1.0) > 0.0) == verdict.feasible
        share = 100.0 * verdict.n_covered / 9
        assert re.search(rf"^{name} +{row['verdict']} +{share:.1f} %", text, re.MULTILINE)
        assert f"<td>{name}</td><td>{row['verdict']}</td><td>{share:.1f} %</td>" in page


STUDY = """
base.case = "a.toml"
vary.robots = ["ur5", "ur3"]
vary."surface.position".x = [-0.2, 0.0, 2.0]
"""


def test_study_from_the_command_line(tmp_path, capsys, monkeypatch) -> None:
    (tmp_path / "a.toml").write_text(TEXTS["plate"])
    (tmp_path / "s.toml").write_text(STUDY)
    out, table = str(tmp_path / "s.study"), tmp_path / "s.csv"
    args = arguments(file=str(tmp_path / "s.toml"), out=out, csv=str(table), json=True)
    assert study_command(args, 0.0) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["tasks"] == 6
    assert said["verdicts"]["feasible"] + said["verdicts"]["infeasible"] == 6
    assert [row["parameters"]["robot"] for row in said["rows"]] == ["ur5"] * 3 + ["ur3"] * 3
    for row in said["rows"]:
        if row["parameters"]["surface.position.x"] == 2.0:
            assert (row["verdict"], row["causes"]) == ("infeasible", {"out_of_reach": 12})
    first = table.read_bytes()
    rows = list(csv.DictReader(io.StringIO(first.decode())))
    for row, other in zip(rows, said["rows"], strict=True):
        assert row["verdict"] == other["verdict"]
        assert float(row["share"]) == other["share"]

    # Once more: nothing is left to do, and the table is the same to the last byte.
    def refuse(*_):
        raise AssertionError("a case that is known is decided again")

    monkeypatch.setattr("feasibility.studies.scheduling.run_one", refuse)
    assert study_command(arguments(file=args.file, out=out, csv=str(table)), 0.0) == 0
    assert table.read_bytes() == first
    text, err = capsys.readouterr()
    assert "6 cases: " in text
    assert "by robot:" in text
    assert "6 finished cases" in err


def test_interrupted_studies_say_what_is_kept(tmp_path, capsys, monkeypatch) -> None:
    (tmp_path / "a.toml").write_text(TEXTS["plate"])
    (tmp_path / "s.toml").write_text(STUDY)

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("feasibility.studies.scheduling.run_one", interrupt)
    args = arguments(file=str(tmp_path / "s.toml"), out=str(tmp_path / "s.study"))
    with pytest.raises(KeyboardInterrupt):
        study_command(args, 0.0)
    assert "0 cases are stored" in capsys.readouterr().err


def test_a_study_with_failures_says_so() -> None:
    study = read_study('base.case = "paper/4a"\nvary."task.cone_deg" = [20, 30, 40]')
    good = {"verdict": "feasible", "evidence": "witness", "share": 1.0, "causes": {},
            "margins": {"limit_deg": 12.0}}  # fmt: skip
    bad = {"verdict": "undecided", "evidence": "budget", "message": "its worker died"}
    rows = [
        Row(task.parameters, "failed" if k == 1 else "done", bad if k == 1 else good, 0.1)
        for k, task in enumerate(study.tasks)
    ]
    text = study_text(study, rows)
    assert "2 feasible, 1 undecided" in text
    assert "1 failed; the first: its worker died" in text
    lines = study_csv(study, rows).splitlines()
    assert lines[2].startswith("30.0,undecided,budget,,,,")
