"""Passes that no single motion runs: the fewest interruptions, and where they are."""

import itertools
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from samples import sampled, seeds

import coverable
from coverable import Task, load_robot, parallel_passes, pass_runs, plan_passes, plane, verify
from feasibility.certification.rate_replay import replay_rates
from feasibility.clock import Clock
from feasibility.division.pass_runs import fewest_runs
from feasibility.roadmap.graph import Roadmap
from surfaces.passes.toolpath import PassPlaces


def roadmap_of(poses, over, steps):
    """Nodes over poses, and motions (x, y, waypoints) between them."""
    roadmap = Roadmap(poses)
    for pose in over:
        roadmap.add_node(pose, np.zeros(1), np.zeros(1), roadmap.add_component())
    for x, y, rows in steps:
        roadmap.add_edge(x, y, np.zeros((rows, 1)))
    return roadmap


def drawn(rng, poses, classes, share):
    """A node over some poses for each class, joined with the next one where both are there."""
    nodes = np.argwhere(rng.random((poses, classes)) < share).tolist()
    steps = [
        (x, y, 1)
        for (x, (i, a)), (y, (j, b)) in itertools.permutations(enumerate(nodes), 2)
        if j == i + 1 and rng.random() < (0.8 if a == b else 0.15)
    ]
    inside = rng.random(poses - 1) < 0.8
    pieces = np.where(inside, rng.integers(1, 4, poses - 1), 0).astype(float)
    return roadmap_of(poses, [pose for pose, _ in nodes], steps), pieces, inside


def between(roadmap, run):
    """The poses at which a run begins and ends; each of its motions goes on from the last."""
    (start, route), here = run, run[0]
    for number in route:
        x, y = roadmap.edges[abs(number) - 1][:2][:: 1 if number > 0 else -1]
        assert x == here
        here = y
    return roadmap.cell[start], roadmap.cell[here]


def measured(roadmap, pieces, found):
    """Undone length and runs, with everything about the runs checked."""
    done, last = np.zeros(len(pieces), dtype=bool), -1
    for run in found:
        first, end = between(roadmap, run)
        assert last <= first < end
        assert not done[first:end].any()
        done[first:end], last = True, end
    return float(pieces[~done].sum()), len(found)


def by_force(roadmap, pieces):
    """The best of all choices of pieces that are worked on, each run as far as sets of nodes go."""
    after = {}
    for x, y, _ in roadmap.edges:
        after.setdefault(x, set()).add(y)
    best = (np.inf, 0)
    for worked in itertools.product((False, True), repeat=len(pieces)):
        runs, possible, here = 0, True, set()
        for over, on in zip(roadmap.over, worked, strict=False):
            if not on:
                here = set()
                continue
            ahead = {y for x in here for y in after.get(x, ())}
            if not ahead:
                ahead, runs = {y for x in over for y in after.get(x, ())}, runs + 1
            possible, here = possible and bool(ahead), ahead
        undone = float(pieces[~np.array(worked)].sum())
        if possible:
            best = min(best, (undone, runs))
    return best


@sampled("seed", seeds(3, all=100))
def test_no_choice_leaves_less_or_has_fewer_runs(seed):
    rng, several = np.random.default_rng(seed), 0
    for share in np.tile([0.4, 0.7, 0.95], 15):
        given = drawn(rng, int(rng.integers(2, 9)), int(rng.integers(1, 4)), share)
        found = measured(*given[:2], fewest_runs(*given))
        assert found == by_force(*given[:2])
        several += found[1] > 1
    assert several > 2


@pytest.mark.parametrize("turn", range(2, 7))
def test_cuts_are_made_between_passes_where_they_can_be(turn):
    """Two classes overlap over six stations; the turn between two passes is one of the pieces."""
    steps = [(k, k + 1, 1) for k in range(7)]
    steps += [(8 + k, 9 + k, 9) for k in range(7)]  # longer, so that later cuts are shorter
    roadmap, inside = roadmap_of(10, [*range(8), *range(2, 10)], steps), np.arange(9) != turn
    first, second = fewest_runs(roadmap, np.where(inside, 0.01, 0.0), inside)
    assert between(roadmap, first)[1] == turn
    assert between(roadmap, second) in ((turn, 9), (turn + 1, 9))


DEG = math.pi / 180.0
LIMITS = [[-150, 150], [-170, -10], [-150, 150], [-180, 180], [-180, 180], [-180, 180]]
UR5 = load_robot("ur5")
SHORT = load_robot("ur5", limits=[[a * DEG, b * DEG] for a, b in LIMITS])
TASK = Task(standoff=0.02, cone_deg=10)


def one_stretch(points):
    """A toolpath through points, seen from above."""
    cells = coverable.poses(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))
    stretch, on = np.zeros(len(points), dtype=np.int64), np.ones(len(points), dtype=bool)
    return cells, PassPlaces(cells.centres, cells.normals, stretch, on)


def ring(count=30):
    """Most of a circle about the base."""
    angle = np.linspace(-170.0, 170.0, count) * DEG
    points = np.column_stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), np.full(count, 0.2)])
    return one_stretch(points)


@pytest.fixture(scope="module")
def found():
    cells, places = ring()
    return pass_runs(SHORT, cells, TASK, places), cells


def test_runs_work_on_all_of_it_and_are_replayed(found):
    runs, cells = found
    assert len(runs.runs) > 1
    assert (runs.left_out, runs.gaps, runs.refusals) == (0.0, (), ())
    for run in runs.runs:
        assert coverable.replay(SHORT, cells, TASK, run.walk, run.needed).accepted
    for cut, (a, b) in zip(runs.cuts, itertools.pairwise(runs.runs), strict=True):
        assert int(a.visits[-1]) <= int(b.visits[0]) <= int(a.visits[-1]) + 1
        assert cut.cause
        assert (cut.move.start == a.walk.q[-1]).all()
        assert (cut.move.end == b.walk.q[0]).all()


def test_one_motion_is_one_run_without_cuts_and_gaps():
    cells, places = ring(20)
    whole = pass_runs(UR5, cells, TASK, places)
    assert len(whole.runs) == 1
    assert whole.cuts == whole.gaps == ()


def test_what_is_left_out_is_named_with_its_cause():
    plate = plane((0.6, 1.0), (-0.1, 0.1), "outside", (0.0, 0.0, 0.2))
    along = plan_passes(UR5, parallel_passes(plate, 0.1, step=0.05), replace(TASK, cone_deg=20))
    runs = pass_runs(UR5, along.cells, along.task, along.places)
    assert runs.gaps
    lengths = [float(run.figures.length) for run in runs.runs]
    assert 0.0 < runs.left_out < along.passes.length
    assert runs.left_out + sum(lengths) == pytest.approx(along.passes.length, abs=0.2)
    assert all(f"along stretch {1 + gap.stretches[0]}: " in gap.cause for gap in runs.gaps)


def test_a_wall_across_a_pass_is_named():
    cells, places = one_stretch([[0.5, y, 0.3] for y in (-0.1, -0.05, 0.05, 0.1)])
    wall = coverable.Obstacle.box("wall", (0.5, 0.01, 0.3), position=(0.5, 0.0, 0.3))
    beside = replace(TASK, cone_deg=30, collision=coverable.Collision(scene=(wall,)))
    runs = pass_runs(UR5, cells, beside, places)
    assert [run.visits.tolist() for run in runs.runs] == [[0, 1], [2, 3]]
    (gap,), (cut,) = runs.gaps, runs.cuts
    assert gap.cause == cut.cause
    assert re.search(r"stretch 1: \w+ and wall come too near to each other$", gap.cause)


def test_runs_hold_the_speed_of_the_task():
    plate = plane((0.35, 0.65), (-0.2, 0.2), "outside", (0.0, 0.0, 0.1))
    fast = Task(standoff=0.02, cone_deg=20, speed=1.3)
    along = plan_passes(UR5, parallel_passes(plate, 0.1, math.pi / 2), fast)
    slow = plan_passes(UR5, along.passes, replace(fast, speed=None))
    assert (along.verdict.feasible, slow.verdict.feasible) == (False, True)
    walk = slow.verdict.witness
    working = slow.cells.surface.works(walk.cell)
    for task, holds in ((fast, False), (replace(fast, speed=0.2), True)):
        judged = verify(UR5, slow.cells, task, walk.q, working=working)
        assert (judged.holds, "rad/s" in judged.refusal) == (holds, not holds)
    runs = pass_runs(UR5, along.cells, fast, along.places, clock=Clock())
    assert runs.runs
    for run in runs.runs:
        assert not replay_rates(UR5, along.cells, fast, run.walk).faults
    said = [cut.cause for cut in runs.cuts] + [gap.cause for gap in runs.gaps]
    assert any("would need" in cause and "rad/s; it allows 3.15" in cause for cause in said)
    assert any("along stretch" in cause for cause in said)


def test_overrun_beyond_reach_is_shortened_and_said():
    plate = plane((0.55, 0.75), (-0.1, 0.1), "outside", (0.0, 0.0, 0.2))
    laid = parallel_passes(plate, 0.1, overrun=0.4, step=0.05)
    along = plan_passes(UR5, laid, replace(TASK, cone_deg=20))
    assert along.verdict.feasible
    assert "ends is shortened to what can be reached" in " ".join(along.passes.notes)
    assert laid.length - 0.8 < along.passes.length < laid.length - 0.1
    for short, each in zip(along.passes.stretches, laid.stretches, strict=True):
        assert short.on_surface.sum() == each.on_surface.sum()
        assert np.isin(short.points, each.points).all()
    assert len(along.cells) == len(along.places.points)
