"""What `explain` says first can be done, in the words of the case file, alone or in pairs."""

from __future__ import annotations

import base64
import html
import io
import math
import re
from functools import cache

import numpy as np
import pytest
from PIL import Image

from feasibility import Answer, check
from feasibility.cases import Case
from feasibility.certification import replay
from feasibility.cli.main import main
from feasibility.reports.changes import key, label, settings
from feasibility.reports.explanation import as_json, as_text, to_try, witnesses
from feasibility.reports.explanation_words import best_changes, helpful, joint_rows
from feasibility.sensitivity import Change, Explanation, Kind, explain
from feasibility.sensitivity.probes import Prober

PLATE = """
surface.kind = "plane"
surface.side = "outside"
task = { standoff = 0.02, cone_deg = 30 }
"""
CASES = {
    # joint1 cannot reach the one side; limits by name of a set
    "named set": """
        robot = { name = "puma560", limits = "set-3" }
        surface.kind = "cylinder"
        surface.radius = 0.5
        surface.side = "inside"
        surface.u_deg = [0, 40]
        surface.v = [0, 0.3]
        surface.cells = [5, 2]
        task = { standoff = 0.005, cone_deg = 45 }
    """,
    "list": """
        robot.name = "puma560"
        robot.limits_deg = [[-90, 10], [-170, 75], [-180, 90], [-135, 170], [-100, 90], [-90, 90]]
        surface.kind = "cylinder"
        surface.radius = 0.5
        surface.side = "inside"
        surface.u_deg = [0, 40]
        surface.v = [0, 0.3]
        surface.cells = [5, 2]
        task = { standoff = 0.005, cone_deg = 45 }
    """,
    "by name": """
        robot.name = "ur5"
        robot.limits_deg.shoulder_pan_joint = [-10, 10]
        surface.u = [0.3, 0.5]
        surface.v = [-0.3, 0.3]
        surface.cells = [1, 3]
        surface.position = [0, 0, 0.2]
    """ + PLATE,
    "shift": """
        robot.name = "ur5"
        surface.u = [-0.1, 0.1]
        surface.v = [-0.1, 0.1]
        surface.cells = [3, 3]
        surface.position = [0.95, 0, 0.2]
    """ + PLATE,
    # out of reach along the diagonal: no shift along one axis is enough
    "diagonal": """
        robot.name = "ur5"
        surface.u = [-0.15, 0.15]
        surface.v = [-0.15, 0.15]
        surface.cells = [3, 3]
        surface.position = [0.8, 0.8, 0.2]
    """ + PLATE,
    "two joints": """
        robot.name = "ur5"
        robot.limits_deg.shoulder_pan_joint = [-10, 10]
        robot.limits_deg.elbow_joint = [-10, 10]
        surface.u = [0.3, 0.6]
        surface.v = [-0.4, 0.4]
        surface.cells = [3, 5]
        surface.position = [0, 0, 0.2]
    """ + PLATE,
    "feasible": """
        robot.name = "ur5"
        surface.u = [0.4, 0.6]
        surface.v = [-0.1, 0.1]
        surface.cells = [3, 3]
        surface.position = [0, 0, 0.3]
    """ + PLATE,
}  # fmt: skip
ONE = ("named set", "list", "by name", "shift")
TWO = ("diagonal", "two joints")


@cache
def case_of(name: str) -> Case:
    return Case.from_toml(CASES[name], name=name)


@cache
def explained(name: str) -> Explanation:
    return explain(*case_of(name).build())


@pytest.mark.parametrize("name", [*ONE, *TWO])
def test_the_change_that_is_named_first_makes_the_case_feasible(name: str) -> None:
    """`check` with the `--set` that is offered says so, without the motion of `explain`."""
    case, found = case_of(name), explained(name)
    assert found.verdict.answer is Answer.INFEASIBLE
    changes = best_changes(found)
    assert len(changes) == (1 if name in ONE else 2)
    assert (found.pair is None) == (name in ONE)
    values = settings(changes, found.verdict, case)
    assert check(*case.with_overrides(values).build()).feasible
    first, *rest = as_text(found, name, case).splitlines()
    assert first.startswith(f"{name}: infeasible. {'One' if name in ONE else 'Two'} change")
    assert key(changes[0].quantity) in first
    assert f"  try  {to_try(found, name, case)}" in rest[:3]
    assert as_json(found, name, case)["useful"]["set"] == values


@pytest.mark.parametrize("name", TWO)
def test_neither_change_of_a_pair_is_enough_alone(name: str) -> None:
    case, found = case_of(name), explained(name)
    assert all(threshold.feasible is None for threshold in found.thresholds)
    assert found.pair is not None
    for change in found.pair.changes:
        alone = settings([change], found.verdict, case)
        assert not check(*case.with_overrides(alone).build()).feasible
    changed = case.with_overrides(settings(found.pair.changes, found.verdict, case)).build()
    every = np.ones(len(changed.cells), dtype=bool)
    assert replay(*changed[:3], found.pair.witness, every).accepted
    assert "pair.csv" in witnesses(found)
    keys = [change["key"] for change in as_json(found, name)["pair"]]
    assert keys == [key(change.quantity) for change in found.pair.changes]


@pytest.mark.parametrize("name", ["named set", "by name", "shift", "feasible"])
def test_every_threshold_can_be_set_in_the_case_file(name: str) -> None:
    """The keys exist, and the case built from them is the one that was searched."""
    case, found = case_of(name), explained(name)
    robot, cells, task, _ = case.build()
    for threshold in found.thresholds:
        quantity, side = threshold.quantity, threshold.feasible
        if side is None:
            continue
        values = settings([Change(quantity, side.value)], found.verdict, case)
        changed = case.with_overrides(values).build()
        limits = np.column_stack([robot.lower, robot.upper])
        if quantity.kind in (Kind.LOWER, Kind.UPPER):
            limits[quantity.joint, int(quantity.kind is Kind.UPPER)] = side.value
        wanted = {Kind.CONE: math.degrees(side.value)}.get(quantity.kind, task.cone_deg)
        shift = side.value * np.array(quantity.axis)
        now = np.column_stack([changed.robot.lower, changed.robot.upper])
        assert np.abs(now - limits).max() < math.radians(0.011)
        assert changed.task.cone_deg == pytest.approx(wanted, abs=0.011)
        moved = cells.centres + (shift if quantity.kind is Kind.SHIFT else 0.0)
        assert np.abs(changed.cells.centres - moved).max() < 1e-8


@pytest.mark.parametrize("name", ["feasible", "named set"])
def test_each_joint_is_shown_with_the_range_that_the_motion_uses(name: str) -> None:
    found = explained(name)
    walk = found.verdict.witness
    if walk is None:
        assert found.dropped is not None
        walk = found.dropped.witness
    assert walk is not None
    what, rows = joint_rows(found)
    assert [row[0] for row in rows] == list(found.verdict.robot.joint_names)
    for row, low, high in zip(rows, *np.degrees([walk.q.min(0), walk.q.max(0)]), strict=True):
        ends = [float(x) for x in re.findall(r"-?[\d.]*\d", row[2])]
        np.testing.assert_allclose(ends, [low, high], atol=0.051)
    text = as_text(found, name)
    assert f"used by {what}" in text
    assert [row["used"] for row in as_json(found, name)["joints"]] == [row[2] for row in rows]


def test_limits_that_the_motion_is_far_from_are_one_line() -> None:
    """A limit of -360 that may tighten to 307.8 helps nobody."""
    found = explained("feasible")
    text = as_text(found, "x")
    (line,) = [part for part in text.split("\n\n") if "Limits that do not matter" in part]
    assert "wrist_3_joint" in line
    assert len(line.splitlines()) <= 2
    rows = [t.quantity for t in helpful(found) if t.quantity.kind in (Kind.LOWER, Kind.UPPER)]
    assert "wrist_3_joint" not in {quantity.name.split()[0] for quantity in rows}
    assert len(text.splitlines()) < 40


def test_a_limit_that_the_motion_needs_keeps_its_row() -> None:
    case = case_of("feasible").with_overrides(["robot.limits_deg.shoulder_pan_joint=[-30, 60]"])
    found = explain(*case.build())
    assert found.verdict.feasible
    rows = {label(t.quantity) for t in helpful(found)}
    assert "robot.limits_deg.shoulder_pan_joint (lower)" in rows


def test_what_is_dropped_is_certified_as_a_division_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the short search for a motion over the rest finds none."""
    plain, whole = explained("named set").dropped, Prober.attempt
    assert plain is not None

    def attempt(self, arrays, seeds, most, deep, needed=None, hard=-1):  # type: ignore[no-untyped-def]
        if needed is not None:
            needed, most = np.ones_like(needed), 0  # more than any motion covers
        return whole(self, arrays, seeds, most, deep, needed, hard)

    monkeypatch.setattr(Prober, "attempt", attempt)
    case = case_of("named set")
    robot, cells, task, _ = case.build()
    dropped = explain(robot, cells, task).dropped
    assert dropped is not None
    assert dropped.waypoints is not None
    assert dropped.witness is not None
    rest = np.ones(len(cells), dtype=bool)
    rest[dropped.cells] = False
    assert rest.sum() == len(cells) - len(plain.cells)
    assert replay(robot, cells, task, dropped.witness, rest).accepted


def test_the_page_has_the_tables_beside_the_view(tmp_path, monkeypatch, capsys) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(CASES["list"])
    assert main(["explain", "case.toml", "--html", "page.html"]) == 1
    first = capsys.readouterr().out.splitlines()[0]
    page = (tmp_path / "page.html").read_text("utf-8")
    title = html.unescape(re.findall(r"<h1>(.*?)</h1>", page)[0])
    assert title.startswith(first[:80])
    beside = page[page.index('<div class="beside">') :]
    assert beside.index("<iframe") < beside.index("<table>")
    assert beside.count("<table>") == 2
    assert "robot.limits_deg.joint1 (upper)" in beside
    # On paper frames are empty: there the picture stands in their place, and on screen nowhere.
    (picture,) = re.findall(r'<img class="printed" src="data:image/png;base64,([^"]+)"', beside)
    with Image.open(io.BytesIO(base64.b64decode(picture))) as image:
        red, _, blue = np.moveaxis(np.asarray(image.convert("RGB"), dtype=int), -1, 0)
    assert ((blue > 180) & (red < 90)).sum() > 200, "edges of G"
    screen, paper = page[: page.index("</style>")].split("@media print")
    assert re.search(r"\.printed \{ display: none; \}", screen)
    assert re.search(r"iframe \{ display: none; \}", paper)
    assert re.search(r"\.printed[^{}]*\{ display: block; \}", paper)
