"""The paper's search on surfaces of every kind: what it reaches, and who has to accept it."""

from dataclasses import replace

import numpy as np
import plain
import pytest
import referee
from mesh_patches import bent, in_cells_of

import coverable
from coverable import Answer, Search, Task, greedy_check, load_robot, mesh, piecewise, sphere, torus
from feasibility.paper.jcell_steps import Steps
from feasibility.paper.tree_and_graph import tree_walk
from feasibility.paper.tree_replay import Path, replay_stored, replay_tree
from robots.kinematics import Kinematics
from surfaces.cell_triangles import triangulation
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.triangle_kernel import cell_under

PUMA, UR5 = load_robot("puma560", limits="set-1"), load_robot("ur5")
TASK = Task(0.005, 45)
COARSE = Search(method="greedy", step_deg=0.5)
RING = torus(0.8, 0.3, (20, 60), (-20, 20), side="inside").cells(3, 3)
JOINED = [torus(0.8, 0.3, u, (-20, 20)) for u in ((20, 40), (40, 60))]
JOINED = piecewise(JOINED, side="inside").cells((2, 3))


@pytest.mark.parametrize(
    "cells", [RING, JOINED, in_cells_of(RING, 6)], ids=["ring", "pieces", "mesh"]
)
def test_triangles_say_what_the_surface_says(cells):
    """Heights, normals and cells within the stated deviations; beyond the border there is none."""
    rng = np.random.default_rng(0)
    for height in (-0.02, 0.03):
        made = triangulation(cells, height, 2e-3)
        some = rng.integers(len(cells), size=200)
        points = cells.centres[some] + height * cells.normals[some]
        points += 0.05 * rng.normal(size=points.shape)
        near = cells.surface.closest(points)
        points -= (near.height - height)[:, None] * near.normal
        exact, where = cells.surface.closest(points), cells.locate(points)
        found = np.array([cell_under(made.kernel, *point) for point in points])
        over = found[:, 0] >= 0
        off = np.abs(found[over, 1] - exact.height[over]).max()
        turn = np.linalg.norm(found[over, 2:] - exact.normal[over], axis=1).max()
        assert off <= made.kernel.deviation + 1e-12
        assert turn <= made.turn + 1e-12
        sure = over & (found[:, 0] < len(cells))
        np.testing.assert_array_equal(found[sure, 0], where[sure])
        assert sure.sum() > 70
        assert (where[~over] == -1).all()


def test_the_replay_of_a_tree_judges_between_jcells():
    verdict = greedy_check(PUMA, RING, TASK, COARSE)
    assert verdict.feasible
    assert replay_stored(verdict, COARSE).accepted
    steps, start = Steps.of(PUMA, RING, TASK, COARSE), verdict.start
    paths = [Path(start, start, verdict.tree.nodes[start]["q"][None])]
    paths += [Path(a, b, motion) for a, b, motion in verdict.tree.edges(data="motion")]
    assert replay_tree(PUMA, RING, TASK, steps, paths).accepted
    points, axes = Kinematics(PUMA).tools(np.concatenate([path.q for path in paths]))
    found = RING.surface.closest(points)
    error = np.abs(found.height + TASK.standoff).max()
    assert error <= verdict.certificate.max_position_error + 1e-5 <= steps.tolerance
    tight = replace(steps, tolerance=0.95 * error)
    assert "off its surface" in replay_tree(PUMA, RING, TASK, tight, paths).refusal
    tilt = np.degrees(referee.angles_between(axes, found.normal)).max()
    narrow = replace(TASK, cone_deg=0.95 * tilt)
    assert "the tool axis tilts" in replay_tree(PUMA, RING, narrow, steps, paths).refusal
    swapped = paths[:1] + [replace(path, neighbour=path.cell) for path in paths[1:]]
    assert "in the cell it claims" in replay_tree(PUMA, RING, TASK, steps, swapped).refusal
    late = [*paths[:-1], replace(paths[-1], q=paths[-1].q[1:])]
    for torn in (late, paths[:1] + paths[:0:-1]):
        refusal = replay_tree(PUMA, RING, TASK, steps, torn).refusal
        assert "a path does not begin where its cell was entered" in refusal


def test_creases_are_named_and_not_crossed():
    task = Task(0.005, 20, tolerance=1e-3)
    slope = 0.4 * np.tan(np.radians(17.0))
    roof = bent(lambda u, v: (0.35 + 0.4 * u, 0.4 * v, 0.2 + slope * np.minimum(u, 1 - u)), 8, 8)
    roof = mesh(TriangleMesh(*roof), side="outside", position=(0, -0.2, 0)).cells(count=12)
    search = Search(method="greedy", step_deg=0.5, cap=300, starts=1)
    verdict = greedy_check(UR5, roof, task, search)
    assert verdict.answer is Answer.INFEASIBLE
    assert not (verdict.covered & roof.creased).any()
    assert verdict.covered.any()
    assert "where the surface is creased or most curved" in verdict.message


@pytest.mark.parametrize(("slope", "crossed"), [(5, True), (40, False)])
def test_pieces_that_meet_at_a_sharp_crease_are_kept_apart(slope, crossed):
    flat = coverable.plane((0.35, 0.5), (-0.1, 0.1), position=(0, 0, 0.3))
    at, turn = (0.5, 0, 0.3), (0, slope, 0)
    tilted = coverable.plane((0.0, 0.15), (-0.1, 0.1), position=at, rpy_deg=turn)
    roof = piecewise((flat, tilted), side="outside").cells((2, 2))
    search = Search(method="greedy", step_deg=0.5, cap=300, starts=1)
    verdict = greedy_check(UR5, roof, Task(0.005, 20, tolerance=1e-3), search)
    assert any(roof.piece[a] != roof.piece[b] for a, b in verdict.graph.edges) == crossed
    assert ("pairs of cells on both sides of a crease" in verdict.message) != crossed
    (fault,) = replay_stored(verdict, search).faults
    assert fault.text.endswith("cells are not in the tree")


def test_a_roll_that_is_limited_is_kept_between_jcells():
    cells = sphere(0.5, (15, 40), (-40, 40), position=(0.3, 0, -0.3), side="outside").cells(3, 3)
    task = Task(0.005, 45, roll_deg=(-20, 20), roll_reference=(1, 0, 0))
    verdict = greedy_check(PUMA, cells, task, COARSE)
    assert verdict.feasible, verdict.message
    walk, allowed = tree_walk(verdict), Steps.of(PUMA, cells, task, COARSE).tolerance
    plain.assert_motion(replace(verdict, task=replace(task, tolerance=allowed)), walk.q)
    arm, form = plain.arm_of(PUMA), plain.surface_of(cells.surface)
    kept = referee.kept_over(arm, form, plain.asked_of(task, cells), referee.evenly(walk.q, 5))
    most = kept.roll.max() + np.radians(20.0)
    assert np.radians(5.0) < most <= verdict.certificate.max_roll <= np.radians(20.0)
    held = replace(task, roll_deg=(-5, 5))
    assert not greedy_check(PUMA, cells, held, COARSE).feasible
    assert not replay_stored(replace(verdict, task=held), COARSE).accepted
