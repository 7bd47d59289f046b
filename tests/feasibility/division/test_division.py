"""Dividing a surface: few patches, a certified walk for each, and the moves between them."""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import replace
from functools import cache
from itertools import pairwise, permutations, product

import numpy as np
import pytest
from dense_replay import assert_motion
from oracle_build import built
from random_arms import planar_arm
from random_cases import draw, draw_ur5

from feasibility import Search, Task, check
from feasibility.cases import CaseError, load_case
from feasibility.certification import replay
from feasibility.cli.case_commands import divide as run
from feasibility.division import Division, Plan, divide
from feasibility.division.connected_labels import count_of
from feasibility.division.partition import Partition
from feasibility.division.plans import connect_pairs, cover_table, plan_of
from feasibility.division.reconfiguration import AS_GOOD, itinerary
from feasibility.reports.division import STATUS, answer_of, as_json, as_text
from feasibility.roadmap import Exploration, arrays_of, explore, links_of, patch_walk
from feasibility.verdict import CauseKind, Walk
from robots import Robot, load_robot
from surfaces import cylinder, plane, sphere
from surfaces.meshes import TriangleMesh, mesh


def assert_plan(plan: Plan, division: Division) -> None:
    """Disjoint patches, walks that a replay accepts, moves that lead from one to the next."""
    robot, cells, task = division.robot, division.cells, division.task
    taken = np.zeros(len(cells), dtype=int)
    for patch in plan.patches:
        taken[patch.cells] += 1
        mine = np.zeros(len(cells), dtype=bool)
        mine[patch.cells] = True
        assert patch.accepted
        again = replay(robot, cells, task, patch.walk, mine)
        assert again.accepted
        assert again.certificate == patch.certificate
        assert patch.area == pytest.approx(cells.areas[mine].sum())
        assert patch.pieces == count_of(np.where(mine, 0, -1), cells.pairs)
    assert taken.max(initial=0) <= 1
    assert len(plan.moves) == max(0, len(plan.patches) - 1)
    for move, (one, other) in zip(plan.moves, pairwise(plan.patches), strict=True):
        assert (move.start == one.walk.q[-1]).all()
        assert (move.end == other.walk.q[0]).all()
    owner = plan.patch_of(len(cells))
    for k, patch in enumerate(plan.patches):
        assert (np.flatnonzero(owner == k) == patch.cells).all()
    assert plan.bound <= len(plan.patches)


def assert_division(division: Division) -> None:
    """Both plans hold, paint the same cells, and every other cell has a cause."""
    assert_plan(division.fewest, division)
    n = len(division.cells)
    inside = division.fewest.patch_of(n) >= 0
    if division.connected is not division.fewest:
        assert_plan(division.connected, division)
        assert len(division.connected.patches) > len(division.patches)
        assert ((division.connected.patch_of(n) >= 0) == inside).all()
    assert all(patch.pieces == 1 for patch in division.connected.patches)
    causes = [cause.cell for cause in division.left_out]
    assert causes == sorted(set(causes))
    rest = sorted([*causes, *division.unsettled.tolist()])
    assert rest == np.flatnonzero(~inside).tolist()
    assert division.ended <= (len(division.unsettled) == 0)
    assert division.whole == inside.all()


TASK = Task(0.01, cone_deg=30)
BEHIND = cylinder(0.6, angle_deg=(150, 210), height=(0.1, 0.5), side="inside")


def posed(pan_deg: tuple[float, float]) -> Robot:
    """A UR5 whose joints, but the first one, keep to one posture."""
    return load_robot("ur5").with_limits(
        {
            "shoulder_pan_joint": np.radians(pan_deg),
            "shoulder_lift_joint": np.radians([-90, 0]),
            "elbow_joint": np.radians([0, 150]),
            "wrist_1_joint": np.radians([-180, 180]),
        }
    )


@cache
def behind(pan_deg: tuple[float, float], again: bool = False) -> Division:
    """A cylinder patch behind the UR5, 60 degrees wide; `again` to divide it once more."""
    return divide(posed(pan_deg), BEHIND.cells(12, 6), TASK)


# what the issue asks for


def test_4d_is_one_patch_of_all_that_can_be_covered() -> None:
    division = divide(*load_case("paper/4d", []).build())
    assert_division(division)
    (patch,) = division.patches
    assert patch.cells.tolist() == list(range(60))
    assert [cause.cell for cause in division.left_out] == list(range(60, 90))
    assert all(cause.proved for cause in division.left_out)
    assert {cause.kind for cause in division.left_out} == {CauseKind.JOINT_LIMITS}
    assert (division.ended, division.optimal, division.whole) == (True, True, False)
    assert answer_of(division) == "partial"


def test_the_seam_of_joint_1_costs_a_patch_and_a_full_turn_removes_it() -> None:
    cut, free = behind((-180, 180)), behind((0, 360))
    assert_division(cut)
    assert len(cut.patches) == 2
    assert (cut.optimal, cut.whole) == (True, True)
    assert cut.connected is cut.fewest
    (move,) = cut.moves
    turns = np.degrees(move.moves)
    # A turn, less the width of the patch at most.
    assert 360 - 75 < abs(turns[0]) <= 360
    assert (np.abs(turns[1:]) < 90).all()
    assert move.described().startswith(f"shoulder_pan_joint by {turns[0]:+.1f} deg")
    # The seam is where the arm points backwards: one patch on either side of it.
    u = np.degrees(cut.cells.u)
    one, other = (u[patch.cells] for patch in cut.patches)
    assert max(one.min(), other.min()) > min(one.max(), other.max())
    assert_division(free)
    assert len(free.patches) == 1
    assert free.whole


def test_the_patch_behind_as_a_mesh() -> None:
    """The same two patches and one, over triangles."""
    u, v = np.meshgrid(np.linspace(*BEHIND.u_range, 60), np.linspace(0.1, 0.5, 40), indexing="ij")
    k = np.arange(u.size).reshape(u.shape)
    corners = [side.ravel() for side in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:])]
    faces = np.vstack(
        [np.stack([corners[i] for i in way], axis=1) for way in ((0, 1, 2), (0, 2, 3))]
    )
    cells = mesh(TriangleMesh(BEHIND.point(u, v).reshape(-1, 3), faces), side="inside").cells(72)
    cut, free = divide(posed((-180, 180)), cells, TASK), divide(posed((0, 360)), cells, TASK)
    for division, number in ((cut, 2), (free, 1)):
        assert_division(division)
        assert (len(division.patches), division.optimal, division.whole) == (number, True, True)
        found = parsed(division)
        assert sorted(k for patch in found["patches"] for (k,) in patch["cells"]) == list(range(72))
        # Cells near the seam may go to either patch; together they are the cylinder's.
        area = sum(patch.area for patch in division.patches)
        assert area == pytest.approx(0.6 * np.radians(60) * 0.4, rel=1e-3)


@pytest.mark.parametrize("name", ["4a", "4f", "5b", "5e"])
def test_paper_cases_agree_with_their_verdicts(name: str) -> None:
    """One patch exactly where `check` says feasible; at least what its best motion covers."""
    setup = load_case(f"paper/{name}", []).build()
    verdict, division = check(*setup), divide(*setup)
    assert_division(division)
    assert verdict.feasible == (division.whole and len(division.patches) == 1)
    assert division.n_covered >= verdict.n_covered


# random cases


@cache
def drawn(arm: str, number: int) -> tuple:
    rng = np.random.default_rng([7, number])
    problem = draw(rng) if arm == "puma560" else draw_ur5(rng)
    return built(problem, load_robot(arm))


DRAWN = [("puma560", number) for number in range(22)] + [("ur5", number) for number in range(8)]


@pytest.mark.parametrize(("arm", "number"), DRAWN[::3])  # all: make campaign NAME=larger_samples
def test_random_cases(arm: str, number: int) -> None:
    """All that any component of a verdict covers is in a patch; one where that is enough."""
    setup = drawn(arm, number)
    verdict, division = check(*setup), divide(*setup)
    assert_division(division)
    assert division.decided
    reached = np.zeros(len(verdict.cells), dtype=bool)
    for component in verdict.components:
        reached[component] = True
    assert (division.fewest.patch_of(len(reached)) >= 0)[reached].all()
    if verdict.feasible:
        assert len(division.patches) == 1
        assert division.whole
    for patch in division.patches[:2]:
        assert_motion(division, patch.walk.q)


def test_the_same_seed_gives_the_same_division() -> None:
    one, two = behind((-180, 180)), behind((-180, 180), again=True)
    for a, b in zip(one.patches, two.patches, strict=True):
        assert (a.cells == b.cells).all()
        assert (a.walk.q == b.walk.q).all()


# walks over some cells of a component


@pytest.mark.parametrize("seed", range(4))
def test_walks_over_random_parts_of_a_component(seed: int) -> None:
    """Any cells, connected or not: the replay finds them all visited."""
    rng = np.random.default_rng(seed)
    robot, cells, task, _ = load_case("paper/4c", []).build()
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), seed)
    explore(exploration)
    assert exploration.complete
    wanted = rng.random(len(cells)) < rng.uniform(0.03, 0.9)
    wanted[rng.integers(len(cells))] = True
    connect_pairs(exploration, exploration.best, wanted)
    links = links_of(exploration.roadmap, exploration.best)
    inside = np.flatnonzero(links.inside)
    inside = inside[wanted[exploration.roadmap.cell[inside]]]
    start = int(rng.choice(inside))
    walk = patch_walk(exploration.roadmap, links, wanted, start)
    assert replay(robot, cells, task, walk, wanted).accepted
    assert (walk.q[0] == exploration.roadmap.q[start]).all()
    assert wanted[walk.cell[-1]]
    assert_motion(check(robot, cells, task), walk.q)


def test_a_cell_that_the_component_misses_is_an_error() -> None:
    robot, cells, task, _ = load_case("paper/4d", []).build()
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), 0)
    explore(exploration)
    links = links_of(exploration.roadmap, exploration.best)
    wanted = np.zeros(90, dtype=bool)
    start = int(np.flatnonzero(links.inside)[0])
    wanted[[int(exploration.roadmap.cell[start]), 89]] = True
    with pytest.raises(ValueError, match="leads to cell 89"):
        patch_walk(exploration.roadmap, links, wanted, start)


# order and ends


def turning_arm(limits: np.ndarray) -> Robot:
    return planar_arm(len(limits)).with_limits(limits)


def largest_by_brute_force(robot: Robot, choices: list[list[Walk]]) -> float:
    """Over all orders, choices, directions and full turns: the least largest move of a joint."""
    versions: list[list[tuple[np.ndarray, np.ndarray]]] = []
    for walks in choices:
        own = []
        for walk in walks:
            for k in product(range(-2, 3), repeat=robot.n):
                q = walk.q + 2 * np.pi * np.array(k)
                if (q >= robot.lower - 1e-12).all() and (q <= robot.upper + 1e-12).all():
                    own += [(q[0], q[-1]), (q[-1], q[0])]
        versions.append(own)
    best = math.inf
    for order in permutations(range(len(choices))):
        for ends in product(*(versions[p] for p in order)):
            worst = max((np.abs(b[0] - a[1]).max() for a, b in pairwise(ends)), default=0.0)
            best = min(best, float(worst))
    return best


@pytest.mark.parametrize("seed", range(40))
def test_the_largest_move_is_the_least_there_is(seed: int) -> None:
    """Two patches, where full turns help, and three or four, where there is no room for any."""
    rng = np.random.default_rng(seed)
    wide = seed % 2 == 0
    half = np.radians(rng.uniform(200, 400, 2) if wide else rng.uniform(60, 179, 2))
    robot = turning_arm(np.stack([-half, half], axis=1))
    count = 2 if wide else int(rng.integers(1, 5))
    choices = []
    for _ in range(count):
        own = []
        for _ in range(int(rng.integers(1, 3))):
            q = rng.uniform(-half, half, (int(rng.integers(1, 4)), 2))
            own.append(Walk(q, np.zeros(len(q), dtype=np.int64)))
        choices.append(own)
    found = itinerary(robot, choices)
    assert sorted(found.order) == list(range(count))
    largest = max((float(np.abs(move.moves).max()) for move in found.moves), default=0.0)
    assert largest <= AS_GOOD * largest_by_brute_force(robot, choices) + 1e-9
    for p, walk in zip(found.order, found.walks, strict=True):
        assert (walk.q >= robot.lower).all()
        assert (walk.q <= robot.upper).all()
        # It is one of the choices, forwards or backwards, up to full turns.
        assert any(
            given.q.shape == walk.q.shape
            and np.allclose(np.ptp(shift := (walk.q - given.q[::way]) / (2 * np.pi), axis=0), 0)
            and np.allclose(shift, np.round(shift))
            for given in choices[p]
            for way in (1, -1)
        )


def test_turns_along_a_chain_of_patches() -> None:
    """A joint that winds on: each next walk is a turn further, and nothing has to be unwound."""
    robot = turning_arm(np.radians([[-170, 1300]]))
    angles = np.radians([(0, 100), (110, 200), (-150, -60), (-50, 80)])
    choices = [[Walk(np.array(pair)[:, None], np.zeros(2, dtype=np.int64))] for pair in angles]
    found = itinerary(robot, choices)
    moves = [abs(math.degrees(float(move.moves[0]))) for move in found.moves]
    assert moves == pytest.approx([10.0] * 3)


def test_many_patches_are_put_in_some_order() -> None:
    rng = np.random.default_rng(0)
    robot = turning_arm(np.radians([[-170, 170], [-170, 170]]))
    choices = [[Walk(rng.uniform(-2, 2, (3, 2)), np.zeros(3, dtype=np.int64))] for _ in range(30)]
    found = itinerary(robot, choices)
    assert sorted(found.order) == list(range(30))
    assert len(found.moves) == 29


# what cannot be divided


def test_no_time_gives_nothing_away() -> None:
    """Only what is proved has a cause; the rest is not settled, and no number is the fewest."""
    setup = load_case("paper/4f", []).build()
    division = divide(*setup[:3], Search(time_limit=1e-6))
    assert_division(division)
    assert (division.ended, division.optimal, division.decided) == (False, False, False)
    assert answer_of(division) == "undecided"
    assert "time limit" in division.message
    assert all(cause.proved for cause in division.left_out)


def test_no_cells_and_no_reach() -> None:
    ur5 = load_robot("ur5")
    none = divide(ur5, plane((0.4, 0.6), (0, 0.2)).cells(0, 3), Task(0.0, 30))
    assert_division(none)
    assert (none.patches, none.whole, answer_of(none)) == ((), True, "complete")
    far = divide(ur5, plane((4, 5), (0, 1)).cells(3, 3), Task(0.0, 30))
    assert_division(far)
    assert far.patches == ()
    assert {cause.kind for cause in far.left_out} == {CauseKind.OUT_OF_REACH}
    assert as_text(far, "far").startswith("not divided: no cell can be covered.")


def test_no_cone_and_a_folded_surface_are_undecided() -> None:
    ur5 = load_robot("ur5")
    patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
    ball = sphere(0.1, (30, 120), (0, 90), side="inside", position=(0.5, 0, 0.3))
    for cells, task in ((patch.cells(2, 2), Task(0.02, 0)), (ball.cells(2, 2), Task(0.1, 30))):
        division = divide(ur5, cells, task)
        assert_division(division)
        assert division.patches == ()
        assert len(division.left_out) == 4
        assert answer_of(division) == "undecided"


def test_the_greedy_search_cannot_divide() -> None:
    with pytest.raises(ValueError, match=r"needs search\.method 'complete', got 'greedy'"):
        divide(*load_case("paper/4d", []).build()[:3], Search(method="greedy"))


# the report


def parsed(division: Division) -> dict:
    return json.loads(json.dumps(as_json(division, 1.5), allow_nan=False))


def test_json_of_a_division() -> None:
    division = behind((-180, 180))
    found = parsed(division)
    assert (found["answer"], found["optimal"], found["at_least"]) == ("complete", True, 2)
    assert (found["cells"], found["covered"], found["connected"]) == (72, 72, None)
    assert found["left_out"] == found["unsettled"] == []
    owner = found["patch_of_cell"]
    for k, patch in enumerate(found["patches"]):
        flat = [division.cells.index(*cell) for cell in patch["cells"]]
        assert flat == [cell for cell in range(72) if owner[cell] == k]
        assert patch["accepted"]
        assert patch["certificate"]["max_position_error_m"] <= 0.001
        assert patch["certificate"]["max_angle_deg"] <= 30 + 1e-9
    (move,) = found["moves"]
    for start, end, joint in zip(move["start"], move["end"], move["joints"], strict=True):
        assert math.radians(joint["by_deg"]) == pytest.approx(end - start)
    assert [joint["joint"] for joint in move["joints"]] == list(division.robot.joint_names)
    assert found["timing"]["load_s"] == pytest.approx(division.timing["load_s"] + 1.5, abs=1e-6)


def test_text_of_a_division() -> None:
    division = behind((-180, 180))
    text = as_text(division, "behind")
    lines = text.splitlines()
    assert lines[0] == "divided: every cell is in a patch that one continuous motion covers."
    assert "72 of 72 cells, in 2 motions" in text
    order = [line.split()[0] for line in lines if line.startswith(("  patch", "  move"))]
    assert order == ["patch", "move", "patch"]
    assert f"shoulder_pan_joint by {np.degrees(division.moves[0].moves[0]):+.1f} deg" in text
    assert max(map(len, lines)) <= 100


def test_a_plan_of_connected_patches_beside_the_fewest() -> None:
    """Three patches of one component: as a plan of their own, in JSON and in the text."""
    division = divide(*load_case("paper/4c", []).build())
    exploration = Exploration(
        division.robot,
        division.cells,
        arrays_of(division.robot, division.cells, division.task),
        division.seed,
    )
    explore(exploration)
    third = np.arange(90) // 30
    made = Partition(rows=np.zeros(3), patch=third, pieces=3, bound=2)
    roots, covers = cover_table(exploration)
    plan = plan_of(exploration, division.task, made, roots, covers)
    assert (len(plan.patches), plan.optimal) == (3, False)
    both = replace(division, connected=plan)
    assert_division(both)
    found = parsed(both)
    assert len(found["patches"]) == 1
    assert len(found["connected"]["patches"]) == 3
    assert (found["connected"]["at_least"], found["connected"]["optimal"]) == (2, False)
    lines = as_text(both, "paper/4c").splitlines()
    head = lines.index("With patches that are each connected on the surface:")
    steps = [line.split()[0] for line in lines[head + 1 :] if line[2:3].isalpha()]
    assert steps == ["patch", "move", "patch", "move", "patch"]


def test_text_of_cells_left_out() -> None:
    division = divide(*load_case("paper/4d", []).build())
    text = as_text(division, "paper/4d")
    assert text.startswith("divided in part")
    assert "60 of 90 cells, in 1 motion" in text
    assert "30 cells: joint limits, proved" in text
    assert [row["cell"] for row in parsed(division)["left_out"]] == [
        [i, j] for i in range(6, 9) for j in range(10)
    ]


@pytest.mark.parametrize(
    ("case", "settings", "status"),
    [
        ("paper/4d", [], 1),
        ("paper/4c", ["task.cone_deg=40"], 0),
        ("paper/4d", ["task.cone_deg=0"], 3),
    ],
)
def test_the_command(
    case: str, settings: list[str], status: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """One JSON object on stdout, and the status of what it says."""
    for as_object in (True, False):
        args = argparse.Namespace(
            command="divide", case=case, settings=settings, json=as_object, html=None, area=False
        )
        assert run(args, time.perf_counter()) == status
        out = capsys.readouterr().out
        if as_object:
            assert STATUS[json.loads(out)["answer"]] == status
        else:
            assert f"  case        {case}" in out


def test_the_command_refuses_the_greedy_search() -> None:
    args = argparse.Namespace(
        command="divide",
        case="paper/4d",
        settings=["search.method=greedy"],
        json=False,
        html=None,
        area=False,
    )
    with pytest.raises(CaseError, match=r"search\.method: a division needs 'complete'"):
        run(args, time.perf_counter())
