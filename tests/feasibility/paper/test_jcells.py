"""Algorithms 1 and 2 on arms and patches small enough to know the answer."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from arm_urdfs import joint
from random_arms import robot_of

from feasibility import Answer, CauseKind, Evidence, Search, Task, greedy_check
from feasibility.paper.algorithm_2 import tree_search
from feasibility.paper.continuity import JSpace, Outcome
from feasibility.paper.jcell_steps import Steps
from robots import Kinematics, Robot, load_robot
from surfaces import Cells, cylinder, plane, sphere


def planar_arm(low: float = -3.1, high: float = 3.1) -> Robot:
    """Two links of 1 m in the xy plane; the tool axis is +x of the second."""
    turning = joint(1, limits=(low, high)), joint(2, xyz=(1, 0, 0), limits=(-3.1, 3.1))
    return robot_of([*turning, joint(3, "fixed", (1, 0, 0))], (1.0, 0.0, 0.0))


def gantry(x: tuple[float, float] = (-2.0, 2.0)) -> Robot:
    """Three prismatic joints along x, y and z; the tool axis is +z, so tool point = q."""
    ranges = x, (-2.0, 2.0), (-2.0, 2.0)
    return robot_of(
        [joint(i + 1, "prismatic", axis=np.eye(3)[i], limits=ranges[i]) for i in range(3)]
    )


def greedy(**settings: object) -> Search:
    return Search(method="greedy", **settings)  # type: ignore[arg-type]


def edges(graph: nx.Graph) -> set[tuple[int, int]]:
    return {(min(e), max(e)) for e in graph.edges}


# An arc of a circle of radius 1.5 m about the base: elbow angle and shoulder angle are independent,
# so turning the shoulder alone runs along the arc, and the shoulder's limits cut it where they say.
ARC = cylinder(1.5, (0, 80), (-0.1, 0.1), side="inside").cells(8, 1)  # 10 degrees each
ELBOW = math.acos(1.5**2 / 2.0 - 1.0)  # cosine rule: |p|^2 = 2 + 2 cos(elbow)


def test_planar_arm_covers_the_arc_cell_by_cell() -> None:
    verdict = greedy_check(planar_arm(), ARC, Task(0.0, 60), greedy(step_deg=0.1))
    assert verdict.answer is Answer.FEASIBLE
    assert edges(verdict.graph) == {(i, i + 1) for i in range(7)}
    assert verdict.start == 4
    assert set(verdict.tree.edges) == {(4, 3), (3, 2), (2, 1), (1, 0), (4, 5), (5, 6), (6, 7)}
    assert list(verdict.tree) == [4, 3, 2, 1, 0, 5, 6, 7]  # depth first
    assert verdict.statistics["calls"] == 7
    for cell in range(8):
        shoulder, elbow = verdict.graph.nodes[cell]["q"]
        assert abs(abs(elbow) - ELBOW) < 1e-6
        polar = math.degrees(shoulder + elbow / 2)  # of the tool point
        assert 10 * cell - 1e-9 <= polar <= 10 * (cell + 1) + 1e-9


@pytest.mark.parametrize("last", [44.0, 53.0, 67.0])
def test_shoulder_limit_cuts_the_arc_where_it_stands(last: float) -> None:
    """Elbow down, the tool is at shoulder + elbow / 2; elbow up it is at shoulder - |elbow| / 2."""
    half = math.degrees(ELBOW) / 2
    high = math.radians(last - half)
    # The lower limit leaves the branch with the elbow up without a start in the middle of the arc.
    arm = planar_arm(-1.0, high)
    verdict = greedy_check(arm, ARC, Task(0.0, 60), greedy(step_deg=0.1))
    reached = math.floor(last / 10)
    assert verdict.answer is Answer.INFEASIBLE
    assert verdict.evidence is Evidence.EXHAUSTED
    assert "not found by the greedy search" in verdict.message
    assert np.flatnonzero(verdict.covered).tolist() == list(range(reached + 1))
    assert edges(verdict.graph) == {(i, i + 1) for i in range(reached)}
    assert [cause.cell for cause in verdict.causes] == list(range(reached + 1, 8))
    assert {(cause.kind, cause.proved) for cause in verdict.causes} == {
        (CauseKind.DISCONNECTED, False)
    }


@pytest.mark.parametrize("moves", ["single", "all"])
def test_gantry_over_a_plane(moves: str) -> None:
    """Every move is a translation, so each of the 8 neighbours can be entered from each cell."""
    cells = plane((0, 0.4), (0, 0.3), side="inside").cells(4, 3)
    arm = gantry()
    verdict = greedy_check(arm, cells, Task(0.05, 30), greedy(step_deg=0.2, moves=moves))
    assert verdict.answer is Answer.FEASIBLE
    assert edges(verdict.graph) == {tuple(pair) for pair in cells.pairs.tolist()}
    assert verdict.statistics["capped"] == 0
    assert verdict.certificate is not None
    assert verdict.certificate.max_angle == 0.0
    step = Steps.of(arm, cells, Task(0.05, 30), greedy(step_deg=0.2)).size
    np.testing.assert_allclose(step, math.radians(0.2) * arm.reach)


def test_rail_limit_cuts_the_plane() -> None:
    """x <= 0.25: cells of the third column of four are touched, those of the fourth are not."""
    cells = plane((0, 0.4), (0, 0.3), side="inside").cells(4, 3)
    verdict = greedy_check(gantry((-1.0, 0.25)), cells, Task(0.05, 30), greedy(step_deg=0.2))
    assert verdict.covered.tolist() == [True] * 9 + [False] * 3
    assert edges(verdict.graph) == {(i, j) for i, j in cells.pairs.tolist() if j < 9}


def reference(
    robot: Robot, cells: Cells, task: Task, q: np.ndarray, target: int, search: Search, cap: int
) -> tuple[str, list[tuple[int, ...]], int]:
    """Algorithm 1 from the paper's text: recursion, a set of checked J-cells, Pinocchio."""
    kinematics = Kinematics(robot)
    steps = Steps.of(robot, cells, task, search)
    p_target = task.targets(cells).points[target]
    sign = cells.surface.side_sign
    n = robot.n
    if search.moves == "single":
        moves = [tuple(s * (i == k) for i in range(n)) for k in range(n) for s in (1, -1)]
    else:
        moves = [m[::-1] for m in itertools.product((0, 1, -1), repeat=n) if any(m)]
    checked = {(0,) * n}

    class Cap(Exception):
        pass

    def cell_and_point(jc: tuple[int, ...]) -> tuple[int, np.ndarray]:
        value = q + np.array(jc) * steps.size
        point, axis = kinematics.tool(value)
        closest_point = cells.surface.closest(point)
        error = abs(float(closest_point.height) - sign * task.standoff)
        good = (
            error <= steps.tolerance - steps.sag[0]
            and -sign * float(closest_point.normal @ axis) >= steps.cone_cosine[0]
            and bool(closest_point.inside)
        )
        nu, nv = cells.shape
        (u0, u1), (v0, v1) = cells.surface.u_range, cells.surface.v_range
        i = min(int((float(closest_point.u) - u0) / (u1 - u0) * nu), nu - 1)
        j = min(int((float(closest_point.v) - v0) / (v1 - v0) * nv), nv - 1)
        return (i * nv + j if good else -1), point

    def cont(jc: tuple[int, ...], point: np.ndarray) -> list[tuple[int, ...]] | None:
        for move in moves:
            jc_n = tuple(a + b for a, b in zip(jc, move, strict=True))
            value = q + np.array(jc_n) * steps.size
            if (value < robot.lower).any() or (value > robot.upper).any() or jc_n in checked:
                continue
            if len(checked) > cap:
                raise Cap
            checked.add(jc_n)
            ec_n, point_n = cell_and_point(jc_n)
            if ec_n < 0:
                continue
            if ec_n == target:
                return [jc, jc_n]
            nearer = np.linalg.norm(point_n - p_target) < np.linalg.norm(point - p_target) - 1e-12
            if nearer and (rest := cont(jc_n, point_n)):
                return [jc, *rest]
        return None

    try:
        path = cont((0,) * n, cell_and_point((0,) * n)[1])
    except Cap:
        return "capped", [], len(checked) - 1
    return ("found" if path else "exhausted"), path or [], len(checked) - 1


@pytest.mark.parametrize("moves", ["single", "all"])
@pytest.mark.parametrize("seed", range(6))
def test_same_jcells_as_the_printed_algorithm(moves: str, seed: int) -> None:
    """Path, outcome and count agree with a recursion written from the paper."""
    rng = np.random.default_rng(seed)
    robot = load_robot("puma560", limits="set-1")
    patch = (
        sphere(1.0 + 0.1 * rng.random(), (20, 70), (20, 150), position=0.05 * rng.normal(size=3))
        if seed % 2
        else cylinder(0.5, (-60, 60), (0.1, 0.8), position=0.05 * rng.normal(size=3))
    )
    cells = patch.cells(6, 6)
    task = Task(0.005, float(rng.uniform(5, 40)))
    search = greedy(step_deg=2.0 if moves == "all" else 0.5, moves=moves, cap=700, starts=1)
    verdict = greedy_check(robot, cells, task, search)
    q, start = verdict.graph.nodes[verdict.start]["q"], verdict.start
    outcomes = set()
    for target in cells.neighbours.of(start).tolist():
        ours = JSpace(robot, cells, task, q, search).continuity(np.zeros(6), target)
        outcome, path, checked = reference(robot, cells, task, q, target, search, 700)
        outcomes.add(outcome)
        assert (ours.outcome, ours.checked) == (outcome, checked)
        assert ours.jcells.tolist() == [list(jcell) for jcell in path]
        np.testing.assert_array_equal(ours.q, q + ours.jcells * ours_step(robot, search))
    assert outcomes


def ours_step(robot: Robot, search: Search) -> np.ndarray:
    return np.full(robot.n, math.radians(search.step_deg))


def test_capped_is_not_exhausted() -> None:
    robot = load_robot("puma560", limits="set-1")
    cells = sphere(1.0, (10, 90), (10, 180)).cells(9, 10)
    task = Task(0.005, 45)
    full = greedy_check(robot, cells, task, greedy(moves="all", step_deg=0.5))
    space = JSpace(robot, cells, task, full.graph.nodes[45]["q"], greedy(cap=50))
    found = space.continuity(np.zeros(6), 46)
    assert (found.outcome, found.checked, len(found.jcells)) == (Outcome.CAPPED, 50, 0)


def test_memory_grows_without_changing_the_answer() -> None:
    """A call of 60,000 J-cells outgrows its first memory; the same J-cells come out."""
    robot = load_robot("puma560", limits="set-1")
    cells = sphere(1.0, (10, 90), (10, 180), position=(0.005, 0, 0)).cells(9, 10)
    task = Task(0.005, 10)
    verdict = greedy_check(robot, cells, task, greedy(starts=1, cap=2000))
    q, stubborn = next(
        (verdict.graph.nodes[a]["q"], k)
        for a in verdict.tree
        for k in cells.neighbours.of(a).tolist()
        if not verdict.graph.has_edge(a, k)
        and JSpace(robot, cells, task, verdict.graph.nodes[a]["q"], greedy(cap=60_000))
        .continuity(np.zeros(6), k)
        .outcome
        is Outcome.CAPPED
    )
    space = JSpace(robot, cells, task, q, greedy(cap=60_000))
    assert space.continuity(np.zeros(6), stubborn).checked == 60_000
    grown = space._memory.nodes[:60_001].copy()
    assert len(np.unique(grown, axis=0)) == 60_001  # each J-cell checked once
    space.continuity(np.zeros(6), stubborn)  # with memory that is large already
    np.testing.assert_array_equal(space._memory.nodes[:60_001], grown)


def test_rigid_motion_of_arm_and_surface_changes_nothing(tmp_path: Path) -> None:
    """The base of a URDF moved by a transform, and the patch with it: the same graph and tree."""
    robot = load_robot("puma560", limits="set-2")
    text = Path(robot.urdf).read_text(encoding="utf-8")
    root = next(
        name
        for name in (part.split('"')[0] for part in text.split('<link name="')[1:])
        if f'<child link="{name}"' not in text
    )
    moved = text.replace(
        "</robot>",
        f'<link name="far"/><joint name="far" type="fixed"><parent link="far"/>'
        f'<child link="{root}"/><origin xyz="0.3 -0.7 1.1" rpy="0.4 -0.9 2.1"/></joint></robot>',
    )
    path = tmp_path / "moved.urdf"
    path.write_text(moved, encoding="utf-8")
    limits = np.column_stack([robot.lower, robot.upper])
    arm = load_robot(path, limits=limits, tool_frame=robot.tool_frame)
    cr, cp, cy = np.cos([0.4, -0.9, 2.1])
    sr, sp, sy = np.sin([0.4, -0.9, 2.1])
    turn = (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )
    patch = cylinder(0.5, (-60, 60), (0, 0.9), position=(0.01, 0.03, 0.02))
    task = Task(0.005, 5)
    search = greedy(moves="all", step_deg=1.0, cap=2000)
    here = greedy_check(robot, patch.cells(9, 10), task, search)
    q = here.graph.nodes[here.start]["q"]
    trees = [
        tree_search(JSpace(r, s.cells(9, 10), task, q, search), s.cells(9, 10), here.start)
        for r, s in ((robot, patch), (arm, patch.moved(turn, [0.3, -0.7, 1.1])))
    ]
    assert 10 < len(trees[0].jcell) < 90
    assert trees[0].parent == trees[1].parent
    assert trees[0].edges.keys() == trees[1].edges.keys()
    assert {k: len(v) for k, v in trees[0].edges.items()} == {
        k: len(v) for k, v in trees[1].edges.items()
    }
    assert trees[0].calls == trees[1].calls


def test_no_cells_and_one_cell() -> None:
    robot = load_robot("puma560", limits="set-1")
    patch = sphere(1.0, (40, 50), (80, 90))
    for shape, count in (((0, 3), 0), ((1, 1), 1)):
        verdict = greedy_check(robot, patch.cells(*shape), Task(0.005, 45), greedy())
        assert verdict.answer is Answer.FEASIBLE
        assert verdict.n_covered == len(verdict.covered) == count
        assert verdict.graph.number_of_edges() == 0
        assert verdict.causes == ()


def test_out_of_reach_is_a_verdict() -> None:
    robot = load_robot("puma560", limits="set-1")
    cells = sphere(1.0, (10, 90), (10, 180), position=(9, 0, 0)).cells(3, 3)
    verdict = greedy_check(robot, cells, Task(0.005, 45), greedy())
    assert verdict.answer is Answer.INFEASIBLE
    assert verdict.n_covered == 0
    assert verdict.tree is None
    assert "no configuration was found" in verdict.message
    assert {(c.kind, c.proved) for c in verdict.causes} == {(CauseKind.OUT_OF_REACH, True)}
    assert len(verdict.causes) == 9


def test_time_limit_gives_undecided() -> None:
    robot = load_robot("puma560", limits="set-1")
    cells = sphere(1.0, (10, 90), (10, 180)).cells(30, 30)
    verdict = greedy_check(robot, cells, Task(0.005, 45), greedy(step_deg=0.001, time_limit=0.05))
    assert (verdict.answer, verdict.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert "time limit" in verdict.message


def test_coarse_steps_are_named() -> None:
    robot = load_robot("puma560", limits="set-1")
    cells = sphere(1.0, (10, 90), (10, 180)).cells(3, 3)
    tight = Task(0.005, 45, tolerance=1e-6)
    verdict = greedy_check(robot, cells, tight, greedy(step_deg=1.0))
    assert verdict.answer is Answer.INFEASIBLE
    assert "too coarse" in verdict.message


def test_bad_start_is_refused() -> None:
    robot = load_robot("puma560", limits="set-1")
    cells = sphere(1.0, (10, 90), (10, 180)).cells(3, 3)
    with pytest.raises(ValueError, match="start must satisfy"):
        greedy_check(robot, cells, Task(0.005, 45), greedy(), start=np.zeros(6))
    with pytest.raises(ValueError, match="6 finite joint values"):
        greedy_check(robot, cells, Task(0.005, 45), greedy(), start=[0.0, math.nan])


def test_same_seed_same_search() -> None:
    robot = load_robot("puma560", limits="set-1")
    cells = cylinder(0.5, (-60, 60), (0, 0.9)).cells(5, 5)
    search = greedy(moves="all", step_deg=1.0, seed=3)
    one, two = (greedy_check(robot, cells, Task(0.005, 20), search) for _ in range(2))
    assert dict(one.statistics) == dict(two.statistics)
    assert nx.utils.edges_equal(one.graph.edges, two.graph.edges)
    for cell in one.tree:
        np.testing.assert_array_equal(one.tree.nodes[cell]["q"], two.tree.nodes[cell]["q"])


REACHABLE = {
    "ur5": plane((0.35, 0.55), (-0.1, 0.1), position=(0, 0, 0.25), side="outside"),
    "panda": plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.2), side="outside"),
    "kinova": plane((0.3, 0.5), (-0.1, 0.1), position=(0, 0, 0.25), side="outside"),
    "xarm7": plane((0.3, 0.5), (-0.1, 0.1), position=(0, 0, 0.2), side="outside"),
}


@pytest.mark.parametrize("name", REACHABLE)
def test_library_arms_cover_a_table(name: str) -> None:
    cells = REACHABLE[name].cells(4, 4)
    search = greedy(moves="all", step_deg=0.5, time_limit=3600.0)
    verdict = greedy_check(load_robot(name), cells, Task(0.02, 20), search)
    assert verdict.answer is Answer.FEASIBLE, verdict.message
    assert verdict.certificate is not None
    assert verdict.certificate.max_angle <= math.radians(20)
    assert nx.is_arborescence(verdict.tree)
