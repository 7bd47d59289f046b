"""Certified area: of published cases, of closed forms, and of what may not be certified."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arm_urdfs import FREE, joint
from landings import random_landings
from random_arms import robot_of
from samples import sampled, spread
from small_cases import small_verdict

from feasibility import Task, check
from feasibility.area import area_from, area_json, area_words, certified_area, measured_area
from feasibility.cases import load_case
from feasibility.certification import replay_over_surface
from feasibility.certification.areas import tiles_hold
from feasibility.clock import Clock
from feasibility.collisions import Collision
from robots import load_robot
from surfaces import piecewise, plane, sphere
from surfaces.cell_tiles import cell_tiles

PAPER = ("5d", "4a", "4b", "4c", "4e", "5a", "5b", "5c", "5f", "5e")


def paper(name, *overrides):
    robot, cells, task, search = load_case(f"paper/{name}", overrides).build()
    return check(robot, cells, task, search)


def assert_links_are_motions(verdict, area, count):
    """The judge of any motion over the surface, which knows of no tiles, accepts the ways."""
    rng = np.random.default_rng(1)
    for row in rng.choice(len(area.areas), size=count, replace=False):
        (node,) = np.flatnonzero((area.nodes.q == area.q[row]).all(axis=1))[:1]
        back = [int(node)]
        while area.nodes.came[back[-1]] >= 0:
            back.append(int(area.nodes.came[back[-1]]))
        none = np.zeros(len(verdict.cells), bool)
        rows = area.nodes.q[back[::-1]]
        judged = replay_over_surface(verdict.robot, verdict.cells, verdict.task, rows, none)
        assert judged.accepted, judged.faults


@sampled
@pytest.mark.parametrize("name", spread(PAPER, 2))
def test_published_cases_are_certified_nearly_everywhere_and_landings_bear_it_out(name):
    verdict = paper(name)
    area = certified_area(verdict)
    assert 0.95 <= area.share <= 1.0
    assert (area.shares <= 1.0).all()
    found = random_landings(verdict, area, 120, np.random.default_rng(7))
    assert found.failed == 0
    assert found.cone_used <= 1.0
    assert_links_are_motions(verdict, area, 4)


def test_tiles_hold_no_more_than_they_do():
    verdict = paper("5d")
    area, sign = certified_area(verdict), verdict.cells.surface.side_sign
    cut = cell_tiles(verdict.cells, sign * verdict.task.standoff)

    def holding(task=verdict.task, robot=verdict.robot, q=area.q, gains=area.gains):
        return tiles_hold(robot, task, cut, area.tiles, q, gains)

    assert holding().all()
    before = np.ones(len(area.areas), dtype=bool)
    for share in (0.95, 0.85, 0.7):  # less cone never holds more
        now = holding(replace(verdict.task, cone_deg=share * verdict.task.cone_deg))
        assert not (now & ~before).any()
        before = now
    assert 0 < before.sum() < len(before)
    # Neither a configuration beside the tile, nor an inverse of something else.
    assert not holding(q=area.q + np.array([0.3, 0, 0, 0, 0, 0])).any()
    assert not holding(gains=np.zeros_like(area.gains)).any()
    assert not holding(gains=np.full_like(area.gains, np.nan)).any()
    assert holding(gains=1.7 * area.gains).all()  # brought to J G = I
    # Nor one at the very limit of a joint that has to move over the tile.
    for side in (0, 1):
        limits = np.column_stack([verdict.robot.lower, verdict.robot.upper])
        limits[0, side] = area.q[len(area.q) // 2, 0]
        narrow = verdict.robot.with_limits(limits)
        assert not holding(robot=narrow)[len(area.q) // 2]


def test_narrower_limits_and_cones_never_enlarge_the_area():
    """The corner of 4b that the limits keep from being certified whole."""
    corner = ("surface.u_deg=[72.2, 90]", "surface.v_deg=[10, 44]", "surface.cells=[2, 2]")
    verdict = paper("4b", *corner)
    cell, first = np.unique(verdict.witness.cell, return_index=True)
    cell, q = cell[cell >= 0], verdict.witness.q[first[cell >= 0]]
    limits, shares = np.column_stack([verdict.robot.lower, verdict.robot.upper]), []
    for less, cone_deg in ((0.0, 45.0), (0.02, 12.0), (0.1, 6.0)):
        robot = load_robot("puma560", limits=limits + [less, -less])
        task = replace(verdict.task, cone_deg=cone_deg)
        shares.append(area_from(robot, verdict.cells, task, cell, q, 20_000).share)
    assert (np.diff(shares) <= 0.0).all(), shares
    assert shares[-1] < shares[0]


def test_a_planar_arm_s_annulus_is_approached_from_below():
    """Two links of 0.3 and 0.25 m turn freely above the plane; a slide lowers the tool."""
    joints = [
        joint(1, "continuous", limits=FREE),
        joint(2, "continuous", (0.3, 0.0, 0.0), limits=FREE),
        joint(3, "prismatic", (0.25, 0.0, 0.0), limits=(-0.5, 0.5)),
    ]
    robot = robot_of([*joints, joint(4, "fixed")], (0.0, 0.0, -1.0))
    surface = plane((-0.6, 0.6), (-0.6, 0.6), side="outside")
    verdict = check(robot, surface.cells(12, 12), Task(standoff=0.01, cone_deg=20))
    area = certified_area(verdict, 150_000)
    low, high = area.tiles.corners[:, 0], area.tiles.corners[:, 2]
    assert (np.linalg.norm(np.maximum(np.maximum(low, -high), 0.0), axis=1) > 0.05).all()
    assert (np.linalg.norm(np.maximum(np.abs(low), np.abs(high)), axis=1) < 0.55).all()
    assert 0.2 < area.area / (np.pi * (0.55**2 - 0.05**2)) < 1.0


def test_pieces_are_certified_as_the_patch_is():
    robot, task = load_robot("puma560"), Task(standoff=0.005, cone_deg=40)
    halves = [sphere(1.0, (40, 60), ends) for ends in ((60, 75), (75, 90))]
    cells = piecewise(halves, side="inside").cells([(1, 2), (1, 2)])
    area = certified_area(check(robot, cells, task))
    assert area.share == pytest.approx(1.0, abs=1e-9)
    assert area.area == pytest.approx(cells.areas.sum(), rel=1e-9)


def test_area_beyond_the_reach_does_not_count_and_words_and_json_say_so():
    verdict = small_verdict("long plate")
    area = certified_area(verdict)
    far = ~verdict.covered & (np.linalg.norm(verdict.cells.centres, axis=1) > 1.3)
    assert far.any()
    assert (area.shares[far] == 0.0).all()
    assert 0.0 < area.share < 1.0
    said = area_json(area)
    shares = {tuple(one["cell"]): one["share"] for one in said["partly_certified"]}
    assert said["certified_area"] == pytest.approx(area.share)
    assert shares[3, 1] == 0.0
    assert 0.0 < shares[0, 0] < 1.0
    assert "2 cells in part, the least [0, " in area_words(area)
    assert area_words(area).endswith("6 cells not at all")
    spent = replace(area, budget=area.evaluations)
    assert "not everything was examined" in area_words(spent)


def test_what_is_not_known_is_not_reported():
    verdict = small_verdict("plate")
    assert measured_area(verdict, Clock()).share == pytest.approx(1.0)
    task = verdict.task
    for other, why in (
        (replace(task, collision=Collision()), "collisions are checked"),
        (replace(task, roll_deg=(-20.0, 20.0)), "roll is limited"),
    ):
        with pytest.raises(ValueError, match=why):
            certified_area(replace(verdict, task=other))
        said = measured_area(replace(verdict, task=other), Clock())
        assert why in said
        assert area_json(said) == {"certified_area": None, "certified_area_note": said}
    with pytest.raises(ValueError, match="greedy"):
        certified_area(replace(verdict, method="greedy"))
