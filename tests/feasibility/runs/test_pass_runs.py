"""Passes that no single motion runs: a ring about an arm whose first joint stops, twice cut."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from feasibility import Task
from feasibility.certification import replay, verify_proof
from feasibility.certification.rates import replay_rates
from feasibility.clock import Clock
from feasibility.reports import pass_runs as report
from feasibility.runs import pass_runs, plan_passes, poses_between
from feasibility.viewer.passes import view_passes
from robots import load_robot
from surfaces import plane, poses
from surfaces.passes import PassPlaces, parallel_passes
from surfaces.toolpaths import PoseCells

DEG = math.pi / 180.0
LIMITS = [[-150, 150], [-170, -10], [-150, 150], [-180, 180], [-180, 180], [-180, 180]]
UR5 = load_robot("ur5")
SHORT = load_robot("ur5", limits=[[a * DEG, b * DEG] for a, b in LIMITS])
TASK = Task(standoff=0.02, cone_deg=10)


def ring(count: int = 30) -> PoseCells:
    """A toolpath of most of a circle about the base."""
    angle = np.linspace(-170.0, 170.0, count) * DEG
    points = np.column_stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), np.full(count, 0.2)])
    return poses(points, np.tile([0.0, 0.0, 1.0], (count, 1)))


def places_of(cells: PoseCells) -> PassPlaces:
    """All of it as one stretch."""
    stretch = np.zeros(len(cells), dtype=np.int64)
    return PassPlaces(cells.centres, cells.normals, stretch, np.ones(len(cells), dtype=bool))


@pytest.fixture(scope="module")
def found():
    cells = ring()
    return pass_runs(SHORT, cells, TASK, places_of(cells)), cells


def test_runs_work_on_all_of_it_and_are_replayed(found) -> None:
    runs, cells = found
    assert len(runs.runs) > 1
    assert runs.left_out == 0.0
    assert not runs.gaps
    assert not runs.refusals
    for run in runs.runs:
        assert replay(SHORT, cells, TASK, run.walk, run.needed).accepted
    for a, b in pairwise(runs.runs):
        assert int(a.visits[-1]) <= int(b.visits[0]) <= int(a.visits[-1]) + 1
    for cut, (a, b) in zip(runs.cuts, pairwise(runs.runs), strict=True):
        assert cut.cause
        assert (cut.move.start == a.walk.q[-1]).all()
        assert (cut.move.end == b.walk.q[0]).all()


def test_no_fewer_runs_are_proved_and_the_proofs_hold(found) -> None:
    """Each piece by the independent verifier; where a lemma's assumption fails, so does this."""
    runs, cells = found
    assert 1 <= len(runs.parted) <= len(runs.cuts)
    last = 0
    for one in runs.parted:
        assert last <= one.first < one.last < len(cells)
        last = one.last
        own = poses_between(cells, one.first, one.last)
        assert np.allclose(own.centres, cells.centres[one.first : one.last + 1])
        assert verify_proof(SHORT, own, TASK, one.proof).accepted
        # Every run ends, or begins, strictly inside.
        assert not any(
            run.visits[0] <= one.first and run.visits[-1] >= one.last for run in runs.runs
        )
        # The arm with its own limits runs the piece: the same tree is refused.
        assert not verify_proof(UR5, own, TASK, one.proof).accepted


def test_where_one_motion_does_nothing_is_proved() -> None:
    cells = ring(20)
    whole = pass_runs(UR5, cells, TASK, places_of(cells))
    assert len(whole.runs) == 1
    assert whole.parted == whole.cuts == whole.gaps == ()


def test_what_is_left_out_is_named_with_its_cause() -> None:
    plate = plane((0.6, 1.0), (-0.1, 0.1), "outside", (0.0, 0.0, 0.2))
    along = plan_passes(UR5, parallel_passes(plate, 0.1), replace(TASK, cone_deg=20))
    runs = pass_runs(UR5, along.cells, along.task, along.places, proof=along.verdict.proof)
    assert runs.gaps
    lengths = [float(run.figures.length) for run in runs.runs]
    assert 0.0 < runs.left_out < along.passes.length
    assert runs.left_out + sum(lengths) == pytest.approx(along.passes.length, abs=0.2)
    assert all(f"along stretch {1 + gap.stretches[0]}: " in gap.cause for gap in runs.gaps)
    labels = [entry.label for entry in view_passes(along, runs.runs).legend.entries]
    assert "left out" in labels
    told = report.as_json(along, replace(runs, runs=()), [], None)
    assert sum(gap["length_m"] for gap in told["left_out"]) == pytest.approx(told["left_out_m"])
    assert told["at_least"]["interruptions"] == len(runs.parted) == 1
    (proof,) = told["at_least"]["proofs"]
    first, last = proof["poses"]
    assert first < first + proof["tree"]["cell"][0] < last
    text = " ".join(report.as_text(along, replace(runs, runs=()), [], None).split())
    assert f"{runs.left_out:.4g} m of {along.passes.length:.4g} m of passes; of stretch" in text


def test_runs_hold_the_speed_of_the_task() -> None:
    plate = plane((0.35, 0.65), (-0.2, 0.2), "outside", (0.0, 0.0, 0.1))
    fast = Task(standoff=0.02, cone_deg=20, speed=1.3)
    along = plan_passes(UR5, parallel_passes(plate, 0.1, math.pi / 2), fast)
    slow = plan_passes(UR5, along.passes, replace(fast, speed=None))
    assert slow.verdict.feasible
    assert not along.verdict.feasible
    runs = pass_runs(UR5, along.cells, fast, along.places, clock=Clock())
    assert runs.runs
    for run in runs.runs:
        assert not replay_rates(UR5, along.cells, fast, run.walk).refusals
    said = [cut.cause for cut in runs.cuts] + [gap.cause for gap in runs.gaps]
    assert said
    assert any("would need" in cause and "rad/s; it allows 3.15" in cause for cause in said)
    assert any("along stretch" in cause for cause in said)


def test_overrun_beyond_reach_is_shortened_and_said() -> None:
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
