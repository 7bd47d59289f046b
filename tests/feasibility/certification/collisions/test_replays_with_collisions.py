"""Replays of motions that cover cells: does the arm stay clear, and where does it not?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from foreign_clearances import ForeignScene, samples

from feasibility import Task, check, verify
from feasibility.cases import load_case
from feasibility.certification import collision_replay, replay, replay_over_surface
from feasibility.collisions import Collision, Obstacle, gather
from feasibility.reports import verdict as report
from robots import load_robot
from surfaces import plane

UR5 = load_robot("ur5")
PLATE = plane((0.4, 0.6), (-0.1, 0.1), position=(0.0, 0.0, 0.3), side="outside")
CELLS = PLATE.cells(2, 2)
TASK = Task(standoff=0.02, cone_deg=30)
EVERY = np.ones(len(CELLS), dtype=bool)


def asked(**settings):
    """The task with what has to stay clear, and the bodies that this means."""
    task = replace(TASK, collision=Collision(**settings))
    return task, gather(UR5, PLATE, task.collision, task.standoff)


@pytest.fixture(scope="module")
def walk():
    """A motion over all cells, clear of itself and of the plate by 5 mm."""
    return check(UR5, CELLS, TASK, collision=Collision(clearance=0.005)).witness


def test_a_covering_motion_with_its_clearance(walk):
    task, bodies = asked(clearance=0.005)
    alone = replay(UR5, CELLS, TASK, walk, EVERY)
    assert (alone.certificate.min_clearance, alone.certificate.nearest_pair) == (None, None)
    found = replay(UR5, CELLS, task, walk, EVERY)
    assert found.accepted
    nothing = {"min_clearance": None, "measured_clearance": None, "nearest_pair": None}
    assert replace(found.certificate, **nothing) == alone.certificate
    foreign = ForeignScene(UR5, bodies)
    least = np.min([foreign.distances(row) for row in samples(walk.q, np.radians(3.0))], axis=0)
    assert 0.5 * least.min() <= found.certificate.min_clearance <= least.min()
    assert 0.99 * least.min() <= found.certificate.measured_clearance <= 1.05 * least.min()
    over = replay_over_surface(UR5, CELLS, TASK, walk.q, EVERY, bodies)
    assert over.accepted
    assert over.certificate.min_clearance == found.certificate.min_clearance
    assert over.certificate.nearest_pair == found.certificate.nearest_pair
    assert verify(UR5, CELLS, task, walk.q).holds


def test_what_is_certified_and_what_was_measured_have_the_truth_between_them():
    """A motion of which little more than half of the clearance is certified."""
    case = load_case(Path(__file__).with_name("clearance_bound.toml"))
    verdict = check(*case.build())
    task = verdict.task
    bodies = gather(verdict.robot, verdict.cells.surface, task.collision, task.standoff)
    foreign, certificate = ForeignScene(verdict.robot, bodies), verdict.certificate
    rows = samples(verdict.witness.q, np.radians(1.0))
    truth = np.min([foreign.distances(row) for row in rows])
    assert certificate.min_clearance <= truth <= certificate.measured_clearance + 1e-4
    assert certificate.measured_clearance <= 1.1 * truth
    said = report.as_json(verdict)["certificate"]
    assert said["measured_clearance_m"] == certificate.measured_clearance
    text = " ".join(report.as_text(verdict, case).split())
    assert f"certified, and {1e3 * certificate.measured_clearance:.3g} mm where they were" in text


def test_more_clearance_than_there_is_is_refused(walk):
    """And no search with less of the tolerance is to follow: it would make no room."""
    task, bodies = asked(clearance=0.005)
    foreign = ForeignScene(UR5, bodies)
    least = np.min([foreign.distances(row) for row in samples(walk.q, np.radians(3.0))], axis=0)
    pair = bodies.pairs[int(np.argmin(least))]
    for more, accepted in ((-2e-3, True), (1e-4, False)):
        clearances = ((pair.first, pair.second, float(least.min()) + more),)
        task, _ = asked(clearance=0.0, clearances=clearances)
        found = replay(UR5, CELLS, task, walk, EVERY)
        assert found.accepted is accepted
        assert found.collides is not accepted
        assert not found.narrowly_refused
    assert f"{pair.first} and {pair.second} are" in found.refusal
    assert not verify(UR5, CELLS, task, walk.q).holds


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_row_nudged_into_a_shelf_is_refused(walk, share):
    """A shelf beside the motion: one row is turned until the arm is in it."""
    shelf = Obstacle.box("shelf", (0.4, 0.02, 0.4), (0.5, 0.38, 0.4))
    _, bodies = asked(self_=False, surface=False, clearance=0.005, scene=(shelf,))
    assert collision_replay(UR5, bodies, walk.q).accepted
    foreign, q = ForeignScene(UR5, bodies), walk.q.copy()
    row = round(share * (len(q) - 1))
    turns = np.linspace(0.0, 2.0 * np.pi, 160)
    pan = np.eye(6)[0]
    q[row, 0] += next(t for t in turns if foreign.distances(q[row] + t * pan).min() <= 0.0)
    found = collision_replay(UR5, bodies, q)
    assert not found.accepted
    assert all(fault.pair[1] == "shelf" for fault in found.faults)
    assert all(abs(fault.row + fault.share - row) < 1.0 for fault in found.faults)
    over = replay_over_surface(UR5, CELLS, TASK, q, None, bodies)
    assert any("shelf" in str(fault) for fault in over.faults)


@pytest.mark.parametrize("thickness", [1e-2, 1e-5])
def test_a_thin_wall_that_only_the_middle_of_a_segment_meets(thickness):
    wall = Obstacle.box("wall", (0.6, thickness, 1.0), (0.7, 0.0, 0.5))
    _, bodies = asked(self_=False, surface=False, scene=(wall,))
    q = np.array([[-0.9, -1.2, 1.5, -1.8, -1.57, 0.0], [0.9, -1.2, 1.5, -1.8, -1.57, 0.0]])
    for row in q:
        assert collision_replay(UR5, bodies, row[None]).accepted
    assert not collision_replay(UR5, bodies, q).accepted
    aside = q + np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert collision_replay(UR5, bodies, aside).accepted
