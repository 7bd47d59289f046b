"""What sentences say: bounds that hold as printed, each cause and each cut, what is not checked."""

import csv
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from asked import question
from hypothesis import given
from hypothesis import strategies as st

import coverable
from coverable import Answer, Evidence, check, list_robots, load_case, load_motion, load_result
from coverable.errors import at_least, at_most
from feasibility.cases.keys import all_keys
from feasibility.collisions.words import UNCHECKED
from feasibility.cut_words import place_of
from feasibility.reports import changes, division, path, study
from feasibility.reports import explanation as explained
from feasibility.reports import verdict as report
from feasibility.reports.verdict_json import as_json, motion_text
from feasibility.results.trajectory_files import as_csv, as_json_text, from_csv
from feasibility.sensitivity.quantities import Kind, Quantity, Variant, quantities
from feasibility.sensitivity.thresholds import Change, Finding, Threshold
from feasibility.verdict import Cause, CauseKind, Certificate, Walk
from robots.known_arms import GROUPS


@pytest.mark.parametrize("digits", [1, 3, 4])
@given(value=st.floats(-1e9, 1e9).filter(lambda x: x == 0.0 or abs(x) > 1e-9))
def test_bounds_are_rounded_to_where_they_hold(digits, value):
    above, below = float(at_most(value, digits)), float(at_least(value, digits))
    assert below <= value <= above
    assert above - below <= 10.0 ** (1 - digits) * abs(value) * (1 + 1e-9)
    for text in (at_most(value, digits), at_least(value, digits)):
        assert len(text.split("e")[0].strip("-0.").replace(".", "")) <= digits


def test_a_certified_clearance_is_rounded_down_whatever_it_is(plate):
    case, verdict = plate
    pair = {"measured_clearance": 1.0, "nearest_pair": ("a", "b")}
    for least in (0.0099996, 0.0123456, 0.9999999):
        made = replace(verdict.certificate, min_clearance=least, min_limit_margin=least, **pair)
        text = " ".join(report.as_text(replace(verdict, certificate=made), case).split())
        assert float(re.search(r"bodies at least (\S+) mm", text)[1]) <= 1e3 * least
        assert float(re.search(r"joints at least (\S+) deg", text)[1]) <= math.degrees(least)


MORE_IS_LESS = (Kind.LOWER, Kind.CLEARANCE, Kind.TOOL_CLEARANCE)


@pytest.mark.parametrize("kind", [Kind.CONE, Kind.UPPER, *MORE_IS_LESS])
@pytest.mark.parametrize("value", [0.1234567, 0.7654321])
def test_feasible_values_allow_more_and_others_less_by_a_digit_at_most(kind, value):
    turns = kind not in (Kind.CLEARANCE, Kind.TOOL_CLEARANCE)
    asked = Quantity(kind, "it", "rad" if turns else "m", 0.0, 1.0)
    exact, digit = (math.degrees(value), 0.01) if turns else (value, 1e-5)
    for feasible in (True, False):
        more = float(changes.number(asked, value, feasible)) - exact
        more *= -1 if (kind in MORE_IS_LESS) == feasible else 1
        assert 0.0 < more < digit


@pytest.mark.parametrize(("given", "others"), [(3, False), (3, True), (100, False)])
def test_no_cone_that_lets_the_tool_point_away_is_proposed(plate, given, others):
    cone = Quantity(Kind.CONE, "cone", "rad", math.radians(given), math.pi, "cone")
    shift = Quantity(Kind.SHIFT, "shift", "m", 0.0, 0.5, "place")
    made = [
        Threshold(quantity, Finding(value, Answer.FEASIBLE, Evidence.WITNESS, "a motion"), None)
        for quantity, value in ((cone, math.radians(120)), (shift, 0.499))
    ]
    verdict = replace(plate[1], answer=Answer.INFEASIBLE)
    said = coverable.Explanation(verdict, tuple(made[: 1 + others]), (), None, 0, 0.0)
    first = explained.as_json(said, "x")["useful"]["sentence"]
    assert ("place by 0.499 m" in first) == others
    assert ("the tool may point away" in first) == (given < 90 and not others)
    assert ("cone 120 deg" in first) == (given > 90)


def numbers_of(robot, cells, task):
    bodies = task.collision
    rest = task.cone_deg, task.standoff, bodies.clearance, bodies.tool_clearance, len(bodies.scene)
    return robot.lower, robot.upper, cells.centres, task.approach, task.roll_deg, rest


def test_the_settings_of_a_change_make_it(commands, plate):
    more = ["task.roll_deg=[-20,40]", "task.roll_reference=[1,0,0]", "task.approach=[0.1,0,-1]"]
    case = load_case(commands.folder / "scene.toml").with_overrides(more)
    given = Variant(*case.build()[:3])
    verdict = replace(plate[1], robot=given.robot, cells=given.cells, task=given.task)
    for q in quantities(given, widen=True):
        if q.name != "without collisions":  # no key says so
            change = Change(q, q.value(min(3, q.last)))
            sets = changes.settings([change], verdict, case)
            made = numbers_of(*case.with_overrides(sets).build()[:3])
            for one, other in zip(made, numbers_of(*q.applied(given, min(3, q.last))), strict=True):
                np.testing.assert_allclose(one, other, atol=1e-9, err_msg=q.name)


@pytest.fixture(scope="module")
def plate(commands):
    case = load_case(commands.folder / "plate.toml")
    return case, check(*case.build())


def test_causes_are_grouped_and_the_largest_group_comes_first(plate, approved):
    case, verdict = plate
    texts = []
    for kind in CauseKind:
        own = [Cause(k, kind, True, f"detail {k}") for k in range(4)]
        other = Cause(5, CauseKind.ORIENTATION, False, "detail 5")
        covered = np.array([False] * 4 + [True, False])
        made = replace(
            verdict, answer=Answer.INFEASIBLE, evidence=Evidence.EXHAUSTED, message="Said so.",
            causes=(other, *own), covered=covered, certificate=None, witness=None,
        )  # fmt: skip
        text = report.as_text(made, case)
        assert text.startswith("infeasible: ")
        *_, missed, tries = text.split("\n\n")
        said = f"{missed}\n" if kind == "collision" else missed.splitlines()[1].strip()
        hints = (" ".join(line.split()[:2]) for line in tries.splitlines()[1:])
        texts.append(f"{kind}: {said}\n  to try: {'; '.join(hints)}")
        cells = [row["cell"] for row in as_json(made)["uncovered"]]
        assert cells == [[1, 2], [0, 0], [0, 1], [0, 2], [1, 0]]
    approved("causes", "\n".join(texts))


def test_a_part_of_the_surface_is_proposed_in_the_words_of_its_kind(plate, approved):
    (case, verdict), lines = plate, []
    for name in ("plate", "waist of points", "ring of poses", "dome of halves", "4a as a mesh"):
        cells, cause = question(name).cells, Cause(0, CauseKind.DISCONNECTED, False, "")
        text = report.as_text(replace(
            verdict, cells=cells, covered=np.zeros(len(cells), dtype=bool), causes=(cause,),
            answer=Answer.UNDECIDED, message="The time limit ran out.", certificate=None,
            witness=None,
        ), case)  # fmt: skip
        lines.append(f"{name}: " + "; ".join(map(str.strip, text.splitlines()[-3:-1])))
    approved("a part", "\n".join(lines))


def test_thresholds_that_there_was_no_time_for_are_named(plate):
    hasty = coverable.explain(*plate[0].build()[:3], coverable.Search(time_limit=1e-9))
    said = " ".join(explained.as_text(hasty, "plate").split())
    start = "ran out before any threshold was searched; unknown: "
    assert start + ", ".join(hasty.left_out) in said
    assert "cone" in hasty.left_out


def test_over_no_cells_there_is_nothing_to_cover_and_without_limits_no_margin(plate):
    case, verdict = plate
    setup = case.build()
    empty = setup.robot, setup.cells.surface.cells(0, 3), setup.task
    none = check(*empty)
    text = report.as_text(none, case)
    assert text.startswith("feasible: there are no cells, so there is nothing to cover")
    assert "motion" not in text
    assert [entry.path for entry in coverable.view(none).legend.entries] == ["/robot"]
    with pytest.raises(ValueError, match="no edge with a motion to draw"):
        coverable.plot_transition(none)
    text = explained.as_text(coverable.explain(*empty), "plate")
    assert text.startswith("plate: there are no cells to cover, so there is nothing to explain.")
    free = replace(verdict, certificate=Certificate(2, 0.0, 0.0, math.inf))
    found = json.loads(json.dumps(as_json(free), allow_nan=False))
    assert found["certificate"]["min_limit_margin_deg"] is None


def test_the_motion_as_a_table_is_the_motion(commands):
    commands.run("check", "files")
    verdict = load_result(commands.folder / "plate.result").verdict
    text = (commands.folder / "walk.csv").read_bytes().decode()
    header, *rows = csv.reader(text.splitlines())
    assert header == ["cell", *verdict.robot.joint_names]
    assert [[float(value) for value in row[1:]] for row in rows] == verdict.witness.q.tolist()
    assert {row[0] for row in rows} - {""} == {str(cell) for cell in range(6)}
    assert text.endswith("\n")
    assert "\r" not in text
    points = json.loads(motion_text(verdict, ".compas"))["data"]["points"]
    assert [point["joint_values"] for point in points] == verdict.witness.q.tolist()
    commands.run("check", "no motion to write")
    assert not (commands.folder / "none.csv").exists()


def test_a_number_of_motions_is_the_least_only_where_the_search_has_ended(plate):
    found = coverable.divide(*plate[0].build()[:3])
    assert (found.optimal, division.as_json(found)["optimal"]) == (True, True)
    assert division.as_json(replace(found, ended=False))["optimal"] is False


def test_what_a_path_goes_over_again_is_not_covered_twice(plate):
    found = coverable.coverage_path(plate[1], "rows")
    length = found.figures.length
    told = path.as_json(replace(found, figures=replace(found.figures, revisited=0.25 * length)))
    assert told["covered_m"] == pytest.approx(0.75 * length)
    assert told["revisited_share"] == pytest.approx(1 / 3)


@pytest.mark.parametrize("side", [-1, 0, 1])
def test_a_motion_across_a_cut_opens_it(commands, side):
    """One threshold of the cone, made up: feasible at 9 degrees, by a motion on a side or both."""
    commands.run("check", "cut")
    verdict = load_result(commands.folder / "cut.result").verdict
    root = verdict.proof.root
    q = np.zeros((2, 6))
    q[:, root.joint] = root.value + np.array([[-0.2, -0.1], [-0.1, 0.1], [0.1, 0.2]][side + 1])
    cone = Quantity(Kind.CONE, "cone", "rad", math.radians(3), math.pi)
    walk = Walk(q, np.array([0, 1]))
    found = Finding(math.radians(9), Answer.FEASIBLE, Evidence.WITNESS, "a motion", witness=walk)
    made = coverable.Explanation(verdict, (Threshold(cone, found, None),), (), None, 0, 0.0)
    (threshold,) = explained.as_json(made, "x")["thresholds"]
    place = place_of(root, verdict.robot)
    lost = list(verdict.cells.unravel((root.below if side < 0 else root.above).cell))
    said = f"the motion then crosses {place}, which no motion can now"
    if side:
        said = f"cell {lost} can then be covered {'below' if side < 0 else 'above'}"
    assert said in threshold["opens"]
    assert said in " ".join(explained.as_text(made, "x").split())
    bare = replace(made, thresholds=(Threshold(cone, replace(found, witness=None), None),))
    assert explained.as_json(bare, "x")["thresholds"][0]["opens"] is None


def test_trajectories_say_it_in_their_header_and_are_read_back(commands, plate, tmp_path):
    commands.run("path", "feasible")
    run = coverable.trajectory(coverable.coverage_path(plate[1]), 0.1)
    table, text = as_csv(run), as_json_text(run)
    assert table.splitlines()[0] == f"# {UNCHECKED}"
    assert json.loads(text)["collisions"] == []
    assert f"# {UNCHECKED}" in (commands.folder / "run.yaml").read_text().splitlines()[:2]
    assert (from_csv(table.partition("\n")[2]).q == run.q).all()
    (tmp_path / "run.csv").write_text(table)
    assert (load_motion(tmp_path / "run.csv", plate[1].robot).q == run.q).all()
    lines = table.splitlines()
    (tmp_path / "run.csv").write_text("\n".join([*lines[:3], "1,2", *lines[3:]]))
    with pytest.raises(ValueError, match="line 4"):  # as an editor counts them
        load_motion(tmp_path / "run.csv", plate[1].robot)


def test_the_body_that_would_do_does(commands):
    said = " ".join(commands.run("check", "collisions").out.split())
    shape = re.search(r'kind = "capsule", (.*?) would do', said)[1].replace("0.0,", "0,")
    bare = json.loads(commands.run("check", "collisions", "--json").out)
    assert bare["unchecked_links"] == ["tool0 to TCP"]
    body = f'collision.tool=[{{kind="capsule", {shape}}}]'
    said = commands.run("check", "collisions", "--json", "--set", body)
    assert json.loads(said.out)["unchecked_links"] == []


def test_keys_prints_each_key_with_type_unit_default_and_meaning(ask):
    said = ask("keys")
    for key in all_keys():
        for text in (key.written, key.type, key.unit, key.default or "needed", key.meaning):
            assert text in said.out
    for asked, wanted in (
        ("surface", lambda key: key.table.startswith("surface")),
        ("surface step", lambda key: key.kind == "step"),
    ):
        rows = json.loads(ask("keys", *asked.split(), "--json").out)["keys"]
        found = [(row["table"], row["kind"] or "", row["key"]) for row in rows]
        assert found == [(one.table, one.kind, one.name) for one in filter(wanted, all_keys())]


def test_robots_and_cases_list_all_there_are(ask):
    said = ask("robots")
    names = [one.name for one in list_robots(catalogue=True)]
    rows = [line for line in said.out.splitlines() if line.endswith((" here", " fetched"))]
    listed = {row.split()[0]: row for row in rows}
    assert (said.status, said.err, list(listed)) == (0, "", names)
    assert max(map(len, said.out.splitlines())) <= 120
    heads = [said.out.index(title[1:]) for title in GROUPS.values()]
    assert heads == sorted(heads)
    for name, words in (
        ("puma560", "1.41 m"), ("puma560", "2.5 kg"), ("kinova", "6 (3 continuous)"),
        ("irb52", "7 kg     coverable  BSD-2-Clause  here"), ("ur20", "to be fetched"),
    ):  # fmt: skip
        assert words in listed[name]
    rows = {row["name"]: row for row in json.loads(ask("robots", "--json").out)["robots"]}
    assert list(rows) == names
    limits = [rows[name]["joints"][0]["limits_deg"] for name in ("puma560", "kinova")]
    assert limits == [[-180.0, 180.0], None]
    far = rows["ur20"]
    assert (far["joints"], far["reach_m"], far["here"]) == (None, 1.75, False)
    two = ask("robots", "puma560", "kinova").out
    for words in ("-180..180", "set-1, set-2, set-3, set-4", "free, 47..313, 19..341, free"):
        assert words in two
    cases = json.loads(ask("cases", "--json").out)["cases"]
    assert [row["name"] for row in cases] == list(coverable.builtin_cases())
    assert cases[0]["cells"] == [9, 10]


def test_a_study_says_what_all_its_cases_check():
    def of(*lines):
        return coverable.read_study("\n".join(['base.case = "paper/4a"', *lines]))

    mixed = of('vary."collision.surface" = [true, false]', 'vary."collision.self" = [true]')
    none = of('vary."task.cone_deg" = [30, 40]')
    alike = of('vary."collision.clearance" = [0.0, 0.01]')
    assert study.as_json(mixed, [])["collisions"] == ["self"]
    assert "in 1 of 2 cases collisions are checked with the arm itself" in study.as_text(mixed, [])
    assert study.as_json(alike, [])["collisions"] == ["self", "surface"]
    assert UNCHECKED not in study.as_text(alike, [])
    assert study.as_json(none, [])["collisions"] == []
    assert UNCHECKED in study.as_html(none, []).lower()
