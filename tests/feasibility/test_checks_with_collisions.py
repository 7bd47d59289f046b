"""`check` of an arm that has a body: what it finds stays clear, and what is in the way is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coverable_errors import ArgumentError
from feasibility import Search, Task, Verdict, check, greedy_check, verify
from feasibility.certification import collision_replay, replay
from feasibility.collisions import Collision, Obstacle, gather
from feasibility.reports.verdict import as_json
from feasibility.verdict import Answer, CauseKind, Evidence, Walk
from robots import load_robot
from surfaces import plane

UR5 = load_robot("ur5")
PLATE = plane((0.4, 0.6), (-0.1, 0.1), position=(0.0, 0.0, 0.3), side="outside")
CELLS = PLATE.cells(2, 2)
TASK = Task(standoff=0.02, cone_deg=30)
FAR = Obstacle.box("cabinet", (0.2, 0.2, 0.2), (0.0, 3.0, 0.0))
ROOF = Obstacle.box("roof", (0.6, 0.6, 0.02), (0.5, 0.0, 0.36))


def checked(*scene: Obstacle, **asked: object) -> Verdict:
    """The plate with objects around it."""
    return check(UR5, CELLS, TASK, collision=Collision(scene=scene, **asked))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def clear() -> Verdict:
    """The plate, the arm clear of itself and of it."""
    return checked(clearance=0.005)


def test_a_motion_that_is_found_stays_clear(clear: Verdict) -> None:
    assert clear.feasible
    assert clear.certificate is not None
    assert clear.certificate.min_clearance is not None
    # The tool may come nearer to the surface than the others.
    assert clear.certificate.min_clearance >= 0.0
    assert clear.witness is not None
    bodies = gather(UR5, PLATE, clear.task.collision, TASK.standoff)
    assert bodies is not None
    assert collision_replay(UR5, bodies, clear.witness.q).accepted


def test_an_object_far_away_changes_nothing(clear: Verdict) -> None:
    with_cabinet = checked(FAR, clearance=0.005)
    assert with_cabinet.statistics["fk"] == clear.statistics["fk"]
    assert with_cabinet.witness is not None
    assert clear.witness is not None
    assert (with_cabinet.witness.q == clear.witness.q).all()


def test_nothing_asked_for_is_no_collision_at_all() -> None:
    with_table = as_json(checked(self_=False, surface=False))
    without = as_json(check(UR5, CELLS, TASK))
    for answer in (with_table, without):
        del answer["timing"]
    assert with_table == without


def test_what_is_in_the_way_is_named() -> None:
    """A roof so low above the plate that the tool cannot come between."""
    verdict = checked(ROOF)
    assert verdict.answer is not Answer.FEASIBLE
    assert {cause.kind for cause in verdict.causes} == {CauseKind.COLLISION}
    assert all(cause.pair is not None and "roof" in cause.detail for cause in verdict.causes)
    found = as_json(verdict)["uncovered"]
    assert all(len(one["pair"]) == 2 and one["clearance_m"] < 0.0 for one in found)


def test_an_object_that_may_be_touched_is_not_in_the_way() -> None:
    links = {solid.owner for solid in gather(UR5, PLATE, Collision(), 0.02).solids}  # type: ignore[union-attr]
    assert checked(ROOF, allow=tuple((link, "roof") for link in sorted(links))).feasible


def test_links_are_cut_into_pieces_only_where_hulls_are_in_the_way(clear: Verdict) -> None:
    """A ball stands in the hull of the upper arm, beside the link itself."""
    q = np.array([2.27, 2.74, 0.66, -1.62, 1.48, -0.77])
    folded = UR5.with_limits(np.column_stack([q - 0.06, q + 0.06]))
    small = plane((-0.01, 0.01), (-0.01, 0.01), "outside", (0.477, -0.75, -0.053)).cells(2, 2)
    ball = Obstacle.sphere("ball", 0.005, (0.0785, -0.2129, 0.0507))
    asked = Collision(self_=False, surface=False, clearance=0.005, scene=(ball,))
    verdict = check(folded, small, TASK, collision=asked)
    assert verdict.feasible
    assert verdict.task.collision is not None
    assert verdict.task.collision.shapes == "pieces"
    assert "0 of 4 cells were covered; so the links were cut into convex pieces" in verdict.message
    assert clear.task.collision is not None
    assert clear.task.collision.shapes == "hulls"
    # Base and upper arm fold beside each other: where the arm is to stay clear of itself, links
    # whose hulls overlap so often are cut from the start.
    verdict = check(folded, small, TASK, collision=Collision(surface=False, clearance=0.005))
    assert verdict.feasible
    assert verdict.task.collision is not None
    assert verdict.task.collision.shapes == "hulls"
    # Nor where it is proved that something collides everywhere.
    crowded = Collision(surface=False, clearance=0.05)
    verdict = check(folded, small, TASK, collision=crowded)
    assert verdict.evidence is Evidence.PROOF
    assert verdict.task.collision is not None
    assert verdict.task.collision.shapes == "hulls"


def test_a_motion_through_an_object_is_refused(clear: Verdict) -> None:
    """The motion that is clear without the roof leads through it."""
    assert clear.witness is not None
    task = replace(TASK, collision=Collision(scene=(ROOF,)))
    everywhere = np.ones(len(CELLS), dtype=bool)
    judged = replay(UR5, CELLS, task, clear.witness, everywhere)
    assert not judged.accepted
    assert "roof" in judged.refusal
    assert judged.certificate.min_clearance is not None
    assert judged.certificate.min_clearance < 0.0


def test_a_search_with_seeds_that_collide_does_not_take_them(clear: Verdict) -> None:
    seeds = Walk(clear.witness.q, clear.witness.cell)  # type: ignore[union-attr]
    task = replace(TASK, collision=Collision(scene=(ROOF,)))
    assert not check(UR5, CELLS, task, seeds=seeds).feasible


def test_the_greedy_search_refuses_what_it_does_not_know() -> None:
    puma = load_robot("puma560", limits="set-1")
    task = replace(TASK, collision=Collision())
    with pytest.raises(ArgumentError, match="knows no collisions"):
        check(puma, CELLS, task, Search(method="greedy"))
    with pytest.raises(ArgumentError, match="knows no collisions"):
        greedy_check(puma, CELLS, task)


def test_verify_refuses_a_motion_that_collides() -> None:
    """One that was found without collisions, and is right in everything else."""
    free = check(UR5, CELLS, TASK)
    assert free.witness is not None
    assert verify(UR5, CELLS, TASK, free.witness.q).holds
    rail = Obstacle.box("rail", (0.3, 0.3, 0.02), (0.5, 0.0, 0.36))
    judged = replace(TASK, collision=Collision(scene=(rail,)))
    refused = verify(UR5, CELLS, judged, free.witness.q)
    assert not refused.holds
    assert any("rail" in fault.text for fault in refused.faults)
    told = replace(free, task=judged)
    assert not verify(told).holds, "nor as a witness of a verdict"
    assert verify(UR5, CELLS, replace(TASK, collision=Collision()), free.witness.q).holds
