"""The replay accepts what holds, refuses everything tampered with, and its figures are bounds."""

from __future__ import annotations

import ast
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from arm_urdfs import joint
from dense_replay import tools
from random_arms import QUESTIONS, between, deviation, planar_arm, question, robot_of

import feasibility
from feasibility import Task, check
from feasibility.certification import replay
from feasibility.verdict import Walk
from surfaces import cylinder, plane, sphere

SEARCH = ("compiled", "roadmap", "paper", "checking", "targets")


def part_of(module, package):
    """Is this the package, or something in it?"""
    return module == package or module.startswith(package + ".")


@cache
def witness(name):
    """The walk that the search found, accepted by the replay."""
    verdict = check(*question(name))
    assert verdict.feasible, verdict
    return verdict.witness


def ask(name, q=None, cell=None, **changes):
    """The replay of the witness of a question, tampered with."""
    robot, cells, task = question(name)
    walk = witness(name)
    walk = Walk(walk.q if q is None else q, walk.cell if cell is None else cell)
    needed = np.ones(len(cells), dtype=bool)
    return replay(robot, cells, replace(task, **changes), walk, needed)


def largest(name):
    """m and rad, the largest deviation of the witness of a question and its largest tilt."""
    robot, cells, task = question(name)
    walk = witness(name)
    q = np.vstack([between(a, b, 20)[1] for a, b in zip(walk.q, walk.q[1:], strict=False)])
    found = deviation(cells.surface, task.standoff, *tools(robot, q))
    assert found.on_patch.all()
    return found.distance.max(), 2.0 * np.arcsin(0.5 * found.chord.max())


@pytest.fixture(params=QUESTIONS)
def name(request):
    """The name of a question."""
    return request.param


def test_figures_bound_what_dense_sampling_finds(name):
    """20 points a segment: tool point, angle and limits are as good as the certificate says.

    The angle is within a hundredth of what is found.
    """
    robot, _, task = question(name)
    walk = witness(name)
    outcome = ask(name)
    assert outcome.accepted
    assert outcome.refusal == ""
    figures = outcome.certificate
    assert figures.waypoints == len(walk.q)
    distance, angle = largest(name)
    assert distance <= figures.max_position_error
    assert angle <= figures.max_angle + 1e-12
    assert figures.max_angle <= 1.01 * angle
    assert figures.max_position_error <= (task.tolerance or 1e-3)
    assert figures.max_angle <= task.cone + 1e-9
    margin = min((walk.q - robot.lower).min(), (robot.upper - walk.q).min())
    assert figures.min_limit_margin == pytest.approx(margin, abs=1e-12)
    assert margin >= 0.0


def test_a_walk_backwards_is_as_good(name):
    """The same motion from its end to its start has the same figures."""
    walk = witness(name)
    back = ask(name, walk.q[::-1], walk.cell[::-1])
    assert back.accepted
    forth = ask(name).certificate
    assert back.certificate.max_position_error == pytest.approx(forth.max_position_error, rel=1e-9)
    assert back.certificate.max_angle == pytest.approx(forth.max_angle, rel=1e-9)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_waypoint_that_is_off_by_one_and_a_half_tolerances(name, share):
    """Moved along the surface's normal by Newton on the tool point, at three places of the walk."""
    robot, cells, task = question(name)
    walk = witness(name)
    row = round(share * (len(walk.q) - 1))
    q = walk.q.copy()
    (point,), _ = tools(robot, q[row : row + 1])
    away = 1.5 * (task.tolerance or 1e-3) * cells.surface.closest(point).normal
    for _ in range(5):
        (now,), _ = tools(robot, q[row : row + 1])
        steps = 1e-6 * np.eye(robot.n)
        jacobian = (tools(robot, q[row] + steps)[0] - now).T / 1e-6
        q[row] += np.linalg.lstsq(jacobian, point + away - now, rcond=1e-6)[0]
    (now,), _ = tools(robot, q[row : row + 1])
    assert np.linalg.norm(now - point - away) < 1e-6
    assert "off its surface" in ask(name, q).refusal


def test_a_cut_off_the_surface(name):
    """Out to a configuration off the surface, and back to the last cell."""
    walk = witness(name)
    last = walk.q[-1:]
    q, cell = np.vstack([walk.q, last + 0.3, last]), np.append(walk.cell, [-1, walk.cell[-1]])
    assert "off its surface" in ask(name, q, cell).refusal


def test_limits_are_exact(name):
    """Limits that the motion just reaches are obeyed; 1e-6 less is too little."""
    robot, cells, task = question(name)
    walk = witness(name)
    needed = np.ones(len(cells), dtype=bool)
    low, high = walk.q.min(axis=0), walk.q.max(axis=0)
    snug = robot.with_limits(np.column_stack([low, high]))
    outcome = replay(snug, cells, task, walk, needed)
    assert outcome.accepted
    assert outcome.certificate.min_limit_margin == 0.0
    for j in range(robot.n):
        for limits, change in ((low, 1e-6), (high, -1e-6)):
            tight = {0: low.copy(), 1: high.copy()}
            tight[int(limits is high)][j] += change
            if tight[0][j] > tight[1][j]:
                continue
            narrow = robot.with_limits(np.column_stack([tight[0], tight[1]]))
            refusal = replay(narrow, cells, task, walk, needed).refusal
            assert f"{robot.joint_names[j]} passes its limit by" in refusal


def test_tolerance_and_cone_are_those_of_the_task(name):
    """The figures just suffice; a little less than what is really there is refused."""
    figures = ask(name).certificate
    exact = {"tolerance": figures.max_position_error,
             "cone_deg": np.degrees(figures.max_angle) + 1e-9}  # fmt: skip
    assert ask(name, **exact).accepted
    distance, angle = largest(name)
    assert "tilts" in ask(name, cone_deg=np.degrees(angle) - 0.01).refusal
    assert not ask(name, tolerance=0.99 * distance).accepted


def test_marks_are_checked(name):
    """Wrong, swapped, missing and impossible marks."""
    walk = witness(name)
    cells = question(name)[1]
    rows = np.flatnonzero(walk.cell >= 0)
    first, other = rows[0], rows[walk.cell[rows] != walk.cell[rows[0]]][0]
    wrong = walk.cell.copy()
    wrong[first] = walk.cell[other]
    misplaced = "is not at its centre's target"
    assert misplaced in ask(name, cell=wrong).refusal
    swapped = walk.cell.copy()
    swapped[[first, other]] = walk.cell[[other, first]]
    assert misplaced in ask(name, cell=swapped).refusal
    unmarked = ask(name, cell=np.where(walk.cell == walk.cell[other], -1, walk.cell))
    assert unmarked.accepted  # it is reached, whether it is marked or not
    still = Walk(walk.q[:1], walk.cell[:1])
    needed = np.zeros(len(cells), dtype=bool)
    needed[[walk.cell[0], walk.cell[other]]] = True
    robot, _, task = question(name)
    assert "never reached" in replay(robot, cells, task, still, needed).refusal
    for impossible in (len(cells), -2, 10**9):
        bad = walk.cell.copy()
        bad[first] = impossible
        assert "not one of" in ask(name, cell=bad).refusal
    between_centres = np.flatnonzero(walk.cell < 0)
    if len(between_centres):
        early = walk.cell.copy()
        early[between_centres[len(between_centres) // 2]] = walk.cell[other]
        assert misplaced in ask(name, cell=early).refusal


def test_a_turn_more_in_one_joint(name):
    """The tool does not notice 2 pi between two waypoints; the motion would."""
    robot = question(name)[0]
    walk = witness(name)
    free = np.full((robot.n, 2), [-np.inf, np.inf])
    _, cells, task = question(name)
    refused = 0
    for j in np.flatnonzero(~robot.prismatic):
        q = walk.q.copy()
        q[len(q) // 2 :, j] += 2.0 * np.pi
        row = len(q) // 2
        _, turn = between(q[row - 1], q[row], 40)
        found = deviation(cells.surface, task.standoff, *tools(robot, turn))
        holds = found.on_patch.all() and found.distance.max() <= (task.tolerance or 1e-3)
        holds &= found.chord.max() <= 2.0 * np.sin(task.cone / 2.0)
        outcome = replay(
            robot.with_limits(free), cells, task, Walk(q, walk.cell), np.ones(len(cells), bool)
        )
        assert holds or not outcome.accepted
        # A wrist that turns about the tool axis itself may turn as often as it likes.
        assert outcome.accepted or j < robot.n - 1
        refused += not outcome.accepted
    assert refused >= robot.n - 2


def test_walks_that_are_malformed(name):
    """NaN and infinity anywhere, shapes that do not fit, nothing at all: refusals, not errors."""
    walk = witness(name)
    for bad in (np.nan, np.inf, -np.inf):
        for row in (0, len(walk.q) // 2, len(walk.q) - 1):
            for column in (0, walk.q.shape[1] - 1):
                q = walk.q.copy()
                q[row, column] = bad
                assert "not a finite number" in ask(name, q).refusal
    assert "no motion of" in ask(name, walk.q[:, 1:]).refusal
    assert "have cells of shape" in ask(name, walk.q[1:]).refusal
    assert "never reached" in ask(name, walk.q[:0], walk.cell[:0]).refusal
    assert "never reached" in ask(name, walk.q[:1], walk.cell[:1]).refusal


def test_one_waypoint_for_one_cell():
    """A motion of one waypoint covers one cell, and only that cell."""
    robot, cells, task = question("puma, dome")
    walk = witness("puma, dome")
    row = int(np.flatnonzero(walk.cell == 7)[0])
    still = Walk(walk.q[row : row + 1], np.array([7]))
    needed = np.zeros(len(cells), dtype=bool)
    assert not replay(robot, cells, task, still, ~needed).accepted
    needed[7] = True
    outcome = replay(robot, cells, task, still, needed)
    assert outcome.accepted
    twice = Walk(walk.q[[row, row]], np.array([7, 7]))
    again = replay(robot, cells, task, twice, needed)
    assert again.accepted
    assert again.certificate.max_angle == outcome.certificate.max_angle


def test_one_joint():
    """An arm of a single joint: its tool follows the inside of a cylinder about the axis."""
    robot = robot_of([joint(1, limits=(-1.0, 1.0)), joint(2, "fixed", (0.5, 0, 0))], (1, 0, 0))
    cells = cylinder(0.51, (-50, 50), (-0.1, 0.1)).cells(5, 1)
    task = Task(0.01, 10)
    q = np.radians(np.linspace(-40, 40, 81))[:, None]
    cell = np.where(np.arange(81) % 20 == 0, np.arange(81) // 20, -1)
    outcome = replay(robot, cells, task, Walk(q, cell), np.ones(5, dtype=bool))
    assert outcome.accepted, outcome.refusal
    sag = 2 * 0.5 * np.radians(1.0) ** 2 / 8
    assert outcome.certificate.max_position_error == pytest.approx(sag, rel=0.05)


def test_a_motion_beside_its_target_is_refused():
    """A mark says that the tool point is at the cell's centre, within the tolerance."""
    arm = planar_arm(3)
    task = Task(0.0, 180, 1e-3)
    q = np.array([[0.0, 0.9, -0.9]])
    (point,), _ = tools(arm, q)
    for beside, accepted in ((0.0, True), (9e-4, True), (1.1e-3, False)):
        patch = plane(
            (point[0] - 0.1 + beside, point[0] + 0.1 + beside), (point[1] - 0.1, point[1] + 0.1),
            position=(0, 0, point[2]), side="outside",
        )  # fmt: skip
        cells = patch.cells(1, 1)
        outcome = replay(arm, cells, task, Walk(q, np.array([0])), np.zeros(1, dtype=bool))
        assert outcome.accepted is accepted


def test_over_a_fold_only_a_single_waypoint_is_certified():
    """A standoff as large as the radius: no bound on the normals holds, so no motion passes."""
    arm = robot_of([joint(i, "prismatic", axis=np.eye(3)[i - 1]) for i in (1, 2, 3)])
    cells = sphere(0.1, (0, 180), (-180, 180), side="inside").cells(4, 4)
    task = Task(0.1, 180, 0.05)
    q = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])
    nowhere = np.zeros(16, dtype=bool)
    for a, b in cells.pairs:
        assert not replay(arm, cells, task, Walk(q, np.array([a, b])), nowhere).accepted
    assert replay(arm, cells, task, Walk(q[:1], np.array([5])), nowhere).accepted


def test_it_shares_no_code_with_the_search():
    """Neither by its own imports, anywhere in the file, nor by what these load."""
    path = Path(feasibility.__file__).parent / "certification" / "motion_replay.py"
    imported = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    search = {f"feasibility.{module}" for module in SEARCH}
    search |= {"robots.chain", "robots.Chain", "surfaces.patches.closed_form_kernels", "numba"}
    assert not {name for name in imported if any(part_of(name, package) for package in search)}
    module = "feasibility.certification.motion_replay"
    shown = subprocess.run(
        [sys.executable, "-c", f"import sys, {module}; print(*sys.modules)"],
        capture_output=True, text=True, check=True, cwd=path.parents[2],
    )  # fmt: skip
    loaded = set(shown.stdout.split())
    assert module in loaded
    search = {f"feasibility.{module}" for module in SEARCH}
    assert not {name for name in loaded if any(part_of(name, package) for package in search)}
