"""Certified area of the published cases, of closed forms, and of what may not be certified."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from arm_urdfs import FREE, joint
from landings import random_landings
from random_arms import robot_of
from small_cases import small_case

from feasibility import Task, check
from feasibility.area import area_from, certified_area
from feasibility.cases import load_case
from feasibility.certification import replay_over_surface
from feasibility.certification.areas import tiles_hold
from feasibility.collisions import Collision
from robots import load_robot
from surfaces import mesh, piecewise, plane, sphere
from surfaces.cell_tiles import cell_tiles

PAPER = ["4a", "4b", "4c", "4e", "5a", "5b", "5c", "5d", "5e", "5f"]
SAMPLE = {"5d": 150, "5e": 100}  # random places of each


def paper(name, *overrides):
    robot, cells, task, search = load_case(f"paper/{name}", overrides).build()
    return check(robot, cells, task, search)


def assert_the_area_is_there(name, places):
    verdict = paper(name)
    area = certified_area(verdict)
    assert area.share >= 0.95
    assert area.evaluations <= area.budget + 100
    assert (area.shares <= 1.0).all()
    found = random_landings(verdict, area, places, np.random.default_rng(7))
    assert found.failed == 0
    assert found.cone_used <= 1.0
    return verdict, area


@pytest.mark.parametrize("name", SAMPLE)
def test_published_cases_are_certified_nearly_everywhere(name):
    assert_the_area_is_there(name, SAMPLE[name])


def ways_back(area, row):
    """Rows from the beginning to the configuration over a tile's middle."""
    (node,) = np.flatnonzero((area.nodes.q == area.q[row]).all(axis=1))[:1]
    back = [int(node)]
    while area.nodes.came[back[-1]] >= 0:
        back.append(int(area.nodes.came[back[-1]]))
    return area.nodes.q[back[::-1]]


def assert_links_are_motions(verdict, area, count):
    """The judge of any motion over the surface, which knows of no tiles, accepts the ways."""
    rng = np.random.default_rng(1)
    for row in rng.choice(len(area.areas), size=count, replace=False):
        rows = ways_back(area, row)
        judged = replay_over_surface(
            verdict.robot, verdict.cells, verdict.task, rows, np.zeros(len(verdict.cells), bool)
        )
        assert judged.accepted, judged.faults


def test_tiles_are_joined_by_motions_and_hold_no_more_than_they_do():
    verdict = paper("5d")
    area = certified_area(verdict)
    assert_links_are_motions(verdict, area, 12)
    cut = cell_tiles(verdict.cells, verdict.cells.surface.side_sign * verdict.task.standoff)

    def holding(task=verdict.task, robot=verdict.robot, q=area.q, gains=area.gains):
        return tiles_hold(robot, task, cut, area.tiles, q, gains)

    assert holding().all()
    # From these configurations, less cone and narrower limits never hold more.
    before = np.ones(len(area.areas), dtype=bool)
    for share in (0.95, 0.85, 0.7):
        now = holding(replace(verdict.task, cone_deg=share * verdict.task.cone_deg))
        assert not (now & ~before).any()
        before = now
    assert 0 < before.sum() < len(before)
    # Neither a configuration beside the tile, nor an inverse of something else.
    assert not holding(q=area.q + np.array([0.3, 0, 0, 0, 0, 0])).any()
    assert not holding(gains=np.zeros_like(area.gains)).any()
    assert not holding(gains=np.full_like(area.gains, np.nan)).any()
    assert holding(gains=1.7 * area.gains).all()  # brought to J G = I
    assert holding(gains=area.gains + 0.01).any()


def test_narrower_limits_and_cones_never_enlarge_the_area():
    # The corner of 4b that the limits keep from being certified whole.
    corner = ("surface.u_deg=[72.2, 90]", "surface.v_deg=[10, 44]", "surface.cells=[2, 2]")
    verdict = paper("4b", *corner)
    cell, first = np.unique(verdict.witness.cell, return_index=True)
    cell, q = cell[cell >= 0], verdict.witness.q[first[cell >= 0]]
    limits = [
        (low, high) for low, high in zip(verdict.robot.lower, verdict.robot.upper, strict=True)
    ]
    shares = []
    for less, cone_deg in ((0.0, 45.0), (0.02, 45.0), (0.02, 12.0), (0.1, 6.0)):
        narrow = [(low + less, high - less) for low, high in limits]
        robot = load_robot("puma560", limits=narrow)
        task = replace(verdict.task, cone_deg=cone_deg)
        shares.append(area_from(robot, verdict.cells, task, cell, q, 20_000).share)
    assert (np.diff(shares) <= 0.0).all(), shares
    assert shares[-1] < shares[0]


def assert_the_annulus_is_approached(budgets):
    # Two links of 0.3 and 0.25 m turn freely above the plane; a slide lowers the tool.
    joints = [
        joint(1, "continuous", limits=FREE),
        joint(2, "continuous", (0.3, 0.0, 0.0), limits=FREE),
        joint(3, "prismatic", (0.25, 0.0, 0.0), limits=(-0.5, 0.5)),
    ]
    robot = robot_of([*joints, joint(4, "fixed")], (0.0, 0.0, -1.0))
    surface = plane((-0.6, 0.6), (-0.6, 0.6), side="outside")
    inner, outer = 0.05, 0.55
    verdict = check(robot, surface.cells(12, 12), Task(standoff=0.01, cone_deg=20))
    found = []
    for budget in budgets:
        area = certified_area(verdict, budget)
        found.append(area.area / (np.pi * (outer**2 - inner**2)))
        low, high = area.tiles.corners[:, 0], area.tiles.corners[:, 2]
        least = np.linalg.norm(np.maximum(np.maximum(low, -high), 0.0), axis=1)
        most = np.linalg.norm(np.maximum(np.abs(low), np.abs(high)), axis=1)
        assert (least > inner).all()
        assert (most < outer).all()
    assert (np.diff(found) > 0.0).all()
    assert found[0] > 0.05
    return found[-1]


def test_a_planar_arm_s_annulus_is_approached_from_below():
    assert assert_the_annulus_is_approached((120_000, 200_000)) > 0.6


def test_a_mesh_and_pieces_are_certified_as_the_patch_is():
    robot, task = load_robot("puma560"), Task(standoff=0.005, cone_deg=40)
    dome = sphere(1.0, (40, 60), (60, 90))
    u, v = (part.ravel() for part in np.meshgrid(*[np.linspace(0, 1, 9)] * 2, indexing="ij"))
    points = dome.point(*(low + share * (high - low) for share, (low, high) in
                          zip((u, v), (dome.u_range, dome.v_range), strict=True)))  # fmt: skip
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate([np.stack([corner, corner + 9, corner + 10], axis=1),
                            np.stack([corner, corner + 10, corner + 1], axis=1)])  # fmt: skip
    halves = [sphere(1.0, (40, 60), ends) for ends in ((60, 75), (75, 90))]
    cells = [
        dome.cells(2, 2),
        piecewise(halves, side="inside").cells([(1, 2), (1, 2)]),
        mesh(SimpleNamespace(vertices=points, faces=faces), side="inside").cells(count=4),
    ]
    for one in cells:
        verdict = check(robot, one, task)
        area = certified_area(verdict)
        assert verdict.feasible
        assert area.share == pytest.approx(1.0, abs=1e-9), one
        assert area.area == pytest.approx(one.areas.sum(), rel=1e-9)
        assert_links_are_motions(verdict, area, 2)


def test_a_fixed_approach_counts_and_an_area_beyond_the_reach_does_not():
    robot = load_robot("ur5")
    dome = sphere(0.3, (0, 40), (0, 360), position=(0.5, 0, 0.2), side="outside")
    task = Task(standoff=0.02, cone_deg=10, approach=(0, 0, -1))
    assert certified_area(check(robot, dome.cells(2, 6), task)).share > 0.999  # less at the pole
    verdict = check(*small_case("long plate").build())
    area = certified_area(verdict)
    far = ~verdict.covered & (np.linalg.norm(verdict.cells.centres, axis=1) > 1.3)
    assert far.any()
    assert (area.shares[far] == 0.0).all()
    assert 0.0 < area.share < 1.0
    beyond = plane((5, 6), (0, 1), side="outside").cells(2, 2)
    assert certified_area(check(robot, beyond, Task(0.01, 20))).share == 0.0


def test_what_is_not_known_is_not_reported():
    robot, cells, task, _ = small_case("plate").build()
    verdict = check(robot, cells, task)
    for other, why in (
        (replace(task, collision=Collision()), "collisions are checked"),
        (replace(task, roll_deg=(-20.0, 20.0)), "roll is limited"),
    ):
        with pytest.raises(ValueError, match=why):
            certified_area(replace(verdict, task=other))
    with pytest.raises(ValueError, match="greedy"):
        certified_area(replace(verdict, method="greedy"))
