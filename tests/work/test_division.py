"""Dividing a surface: few patches, a certified walk for each, and the moves between them."""

import itertools
import json
import math
from dataclasses import replace
from functools import cache
from itertools import pairwise, permutations, product
from pathlib import Path

import json_of
import networkx as nx
import numpy as np
import pytest
from asked import question, stored
from jobs import run_coverable
from oracle_cases import read
from plain import assert_motion
from random_arms import planar_arm
from samples import sampled, spread

import coverable
from coverable import Search, Task, check, divide, load_case, load_robot, plane, replay, sphere
from feasibility.certification.cut_proofs.proof_verification import verify_proof
from feasibility.certification.rate_replay import replay_rates
from feasibility.cut_tree import Leaf
from feasibility.division.reconfiguration import itinerary, straight_moves
from feasibility.reports.division import as_json, as_text
from feasibility.verdict import CauseKind, Walk

UR5 = load_robot("ur5")
TASK = Task(0.01, cone_deg=30)
BEHIND = coverable.cylinder(0.6, angle_deg=(150, 210), height=(0.1, 0.5), side="inside")


def disconnected_problem(number):
    """A stored problem that falls apart with every cell in reach."""
    asked = zip(stored("puma560"), read("puma560"), strict=True)
    apart = [n for n, (p, t) in asked if not t.feasible and t.reachable == np.prod(p.cells)]
    return question(apart[number])[2:5]


def assert_division(division):
    """Disjoint patches, walks that a replay accepts, moves between them, causes of the rest."""
    robot, cells, task, plan = division.robot, division.cells, division.task, division
    taken, touching = np.zeros(len(cells), dtype=int), nx.Graph(cells.pairs.tolist())
    touching.add_nodes_from(range(len(cells)))
    for patch in plan.patches:
        taken[patch.cells] += 1
        mine = np.isin(np.arange(len(cells)), patch.cells)
        again = replay(robot, cells, task, patch.walk, mine)
        assert (patch.accepted, again.accepted) == (True, True)
        assert again.certificate == patch.certificate
        assert patch.area == pytest.approx(cells.areas[mine].sum())
        assert patch.pieces == nx.number_connected_components(touching.subgraph(patch.cells))
    assert taken.max(initial=0) <= 1
    assert len(plan.moves) == max(0, len(plan.patches) - 1)
    for move, (one, other) in zip(plan.moves, pairwise(plan.patches), strict=True):
        assert (np.stack([move.start, move.end]) == [one.walk.q[-1], other.walk.q[0]]).all()
    owner = plan.patch_of(len(cells))
    for k, patch in enumerate(plan.patches):
        assert (np.flatnonzero(owner == k) == patch.cells).all()
    assert plan.bound <= len(plan.patches)
    inside = owner >= 0
    causes = [cause.cell for cause in division.left_out]
    assert causes == sorted(set(causes))
    assert sorted([*causes, *division.unsettled.tolist()]) == np.flatnonzero(~inside).tolist()
    assert division.ended <= (len(division.unsettled) == 0)
    assert division.whole == inside.all()


def posed(pan_deg):
    """A UR5 whose joints, but the first one, keep to one posture."""
    limits = {"shoulder_pan_joint": pan_deg, "shoulder_lift_joint": (-90, 0),
              "elbow_joint": (0, 150), "wrist_1_joint": (-180, 180)}  # fmt: skip
    return UR5.with_limits({name: np.radians(ends) for name, ends in limits.items()})


@cache
def behind(low, high):
    return divide(posed((low, high)), BEHIND.cells(8, 2), TASK)


def test_4d_is_one_patch_of_all_that_can_be_covered():
    said = run_coverable("divide", "paper/4d", "--json")
    told = json.loads(said.out)
    assert (said.status, told["answer"], told["covered"]) == (1, "partial", 60)
    assert [tuple(row["cell"]) for row in told["left_out"]] == [*product(range(6, 9), range(10))]
    division = divide(*load_case("paper/4d", []).build())
    assert_division(division)
    assert [patch.cells.tolist() for patch in division.patches] == [list(range(60))]
    assert all(cause.proved for cause in division.left_out)
    assert {cause.kind for cause in division.left_out} == {CauseKind.JOINT_LIMITS}
    assert (division.ended, division.optimal, division.whole) == (True, True, False)


def test_patches_are_joined_beside_the_curves_between_centres():
    division = divide(*load_case(Path(__file__).with_name("beside_curves.toml"), []).build())
    assert sorted(len(patch.cells) for patch in division.patches) == [1, 4]


def test_the_seam_of_joint_1_costs_a_patch_and_a_full_turn_removes_it():
    cut, free = behind(-180, 180), behind(0, 360)
    for division, number in ((cut, 2), (free, 1)):
        assert_division(division)
        assert (len(division.patches), division.optimal, division.whole) == (number, True, True)
    (move,) = cut.moves
    turns = np.degrees(move.moves)
    assert 360 - 75 < abs(turns[0]) <= 360  # a turn, less the width of the patch at most
    assert (np.abs(turns[1:]) < 90).all()
    # The seam is where the arm points backwards: one patch on either side of it.
    u = np.degrees(cut.cells.u)
    one, other = (u[patch.cells] for patch in cut.patches)
    assert max(one.min(), other.min()) > min(one.max(), other.max())


def drawn(arm, number):
    return question(np.random.default_rng([7, number]).choice(stored(arm)))[2:5]


DRAWN = [("puma560", number) for number in range(22)] + [("ur5", number) for number in range(8)]
PAPER = ["4a", "4f", "5b", "5e"]


@sampled(("arm", "number"), [*[("paper", name) for name in PAPER], *spread(DRAWN, 3)])
def test_divisions_agree_with_verdicts(arm, number):
    """One patch exactly where `check` says feasible; at least what any of its motions covers."""
    setup = load_case(f"paper/{number}", []).build() if arm == "paper" else drawn(arm, number)
    verdict, division = check(*setup), divide(*setup)
    assert_division(division)
    assert division.decided
    assert verdict.feasible == (division.whole and len(division.patches) == 1)
    reached = np.zeros(len(verdict.cells), dtype=bool)
    for component in verdict.components:
        reached[component] = True
    assert (division.patch_of(len(reached)) >= 0)[reached].all()
    for patch in division.patches[:2] if arm != "paper" else ():
        assert_motion(division, patch.walk.q)


@pytest.mark.parametrize(("number", "motions"), [(1, 2), (21, 3)])
def test_how_many_it_takes_at_least_is_proved(number, motions):
    """By proofs that other code accepts, of cells no two of which any motion has."""
    setup = disconnected_problem(number)
    division = divide(*setup)
    case = division.robot, division.cells, division.task
    assert len(division.patches) == division.at_least == motions
    assert division.proved_fewest
    assert not isinstance(division.proof.root, Leaf)
    assert verify_proof(*case, division.proof).accepted
    for apart in division.apart:
        assert verify_proof(*case, apart.proof).accepted
        assert {leaf.cell for leaf in apart.proof.leaves()} == {apart.cell, apart.other}
    pairs = {(apart.cell, apart.other) for apart in division.apart}
    cells = sorted({cell for pair in pairs for cell in pair})
    assert len(cells) == (motions if motions > 2 else 0)
    assert pairs == set(itertools.combinations(cells, 2))
    patch = division.patch_of(len(division.cells))
    assert len(set(patch[cells].tolist())) == len(cells)  # no motion found has two of them
    json_of.agree(json.loads(json.dumps(as_json(division))), json_of.of_divide(division))
    assert ("no two can be covered by one motion" in as_text(division, "x")) == (motions > 2)
    hasty = divide(*setup, Search(time_limit=1e-6))
    assert (hasty.ended, hasty.proof, len(hasty.apart)) == (False, None, 0)
    assert hasty.at_least <= 1


CELLS = plane((0.35, 0.65), (-0.2, 0.2), "outside", (0.0, 0.0, 0.1)).cells(5, 6)


@pytest.mark.parametrize(("asked", "whole"), [
    ({"speed": 0.8}, True), ({"speed": 1.5}, False), ({"min_manipulability": 0.2}, False),
])  # fmt: skip
def test_every_patch_holds_the_rates_that_are_asked(asked, whole):
    task = replace(Task(standoff=0.02, cone_deg=20), **asked)
    found = divide(UR5, CELLS, task)
    assert_division(found)
    assert found.whole == whole == (check(UR5, CELLS, task).answer is coverable.Answer.FEASIBLE)
    for patch in found.patches:
        assert not replay_rates(UR5, CELLS, task, patch.walk).faults
        assert len(patch.cells) > 1
    said = "would need" if task.speed else "singular values fall to"
    assert all(said in cause.detail for cause in found.left_out)
    with pytest.raises(ValueError, match=r"less than 11\.2 m/s anywhere"):
        divide(UR5, CELLS, replace(task, speed=50.0))


def test_what_cannot_be_divided():
    none = divide(UR5, plane((0.4, 0.6), (0, 0.2)).cells(0, 3), Task(0.0, 30))
    far = divide(UR5, plane((4, 5), (0, 1)).cells(3, 3), Task(0.0, 30))
    patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside").cells(2, 2)
    ball = sphere(0.1, (30, 120), (0, 90), side="inside", position=(0.5, 0, 0.3)).cells(2, 2)
    no_cone, folded = divide(UR5, patch, Task(0.02, 0)), divide(UR5, ball, Task(0.1, 30))
    for division, left_out, whole, decided in (
        (none, 0, True, True), (far, 9, False, True),
        (no_cone, 4, False, False), (folded, 4, False, False),
    ):  # fmt: skip
        assert_division(division)
        assert (division.patches, division.whole) == ((), whole)
        assert len(division.left_out) == left_out
        assert division.decided == decided
    assert {cause.kind for cause in far.left_out} == {CauseKind.OUT_OF_REACH}
    with pytest.raises(ValueError, match="greedy"):
        divide(UR5, patch, Task(0.02, 30), Search(method="greedy"))
    for settings, status in (("task.cone_deg=0", 3), ("search.method=greedy", 2)):
        assert run_coverable("divide", "paper/4d", "--set", settings).status == status


def largest_by_brute_force(robot, choices):
    """Over all orders, choices, directions and full turns: the least largest move of a joint."""
    versions = []
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


@pytest.mark.parametrize("seed", range(24))
def test_the_largest_move_is_the_least_there_is(seed):
    """Two patches, where full turns help, and up to four, where there is no room for any."""
    rng, wide = np.random.default_rng(seed), seed % 2 == 0
    half = np.radians(rng.uniform(200, 400, 2) if wide else rng.uniform(60, 179, 2))
    robot = planar_arm(2).with_limits(np.stack([-half, half], axis=1))
    choices = []
    for _ in range(2 if wide else int(rng.integers(1, 5))):
        own = []
        for _ in range(int(rng.integers(1, 3))):
            q = rng.uniform(-half, half, (int(rng.integers(1, 4)), 2))
            own.append(Walk(q, np.zeros(len(q), dtype=np.int64)))
        choices.append(own)
    order, walks = itinerary(robot, choices)
    assert sorted(order) == list(range(len(choices)))
    moves = straight_moves(robot, walks)
    largest = max((float(np.abs(move.moves).max()) for move in moves), default=0.0)
    assert largest <= 1.02 * largest_by_brute_force(robot, choices) + 1e-9
    for p, walk in zip(order, walks, strict=True):
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


def test_turns_along_a_chain_of_patches():
    """A joint that winds on: each next walk is a turn further, and nothing has to be unwound."""
    robot = planar_arm(1).with_limits(np.radians([[-170, 1300]]))
    angles = np.radians([(0, 100), (110, 200), (-150, -60), (-50, 80)])
    choices = [[Walk(np.array(pair)[:, None], np.zeros(2, dtype=np.int64))] for pair in angles]
    found = straight_moves(robot, itinerary(robot, choices)[1])
    moves = [abs(math.degrees(float(move.moves[0]))) for move in found]
    assert moves == pytest.approx([10.0] * 3)
