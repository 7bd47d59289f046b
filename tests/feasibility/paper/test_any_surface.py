"""The paper's search on surfaces of every kind: what it reaches, and who has to accept it."""

from __future__ import annotations

import pathlib
from dataclasses import replace

import numpy as np
import pytest
from mesh_patches import grid
from meshed_patches import in_cells_of

from feasibility import Answer, Search, Task, check, greedy_check
from feasibility.cases import load_case
from feasibility.paper import starts, tree_walk
from feasibility.paper.jcell_steps import Steps
from feasibility.paper.tree_replay import Path, replay_stored, replay_tree
from feasibility.roll import projected, roll_of
from robots import Kinematics, load_robot
from surfaces import cell_under, mesh, piecewise, plane, sphere, torus, triangulation
from surfaces.meshes import TriangleMesh

PUMA = load_robot("puma560", limits="set-1")
TASK = Task(0.005, 45)
DOME = sphere(1.0, (10, 90), (10, 180), side="inside").cells(9, 10)  # of the paper's case 4a
MESH = in_cells_of(DOME, 6)
COARSE = Search(method="greedy", step_deg=0.5)
RING = torus(0.8, 0.3, (20, 60), (-20, 20), side="inside").cells(3, 3)


def folded(angle_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """A roof of 0.4 m x 0.4 m with its ridge along y, as vertices and faces."""
    u, v, faces = grid(8, 8)
    x = 0.4 * u
    z = np.tan(np.radians(angle_deg)) * np.minimum(x, 0.4 - x)
    return np.column_stack([0.35 + x, 0.4 * v - 0.2, 0.2 + z]), faces


def test_the_mesh_of_a_dome_is_searched_as_the_dome() -> None:
    """From every start over the middle cell the same cells are reached, be it all 90 or 60."""
    points, approaches, _ = TASK.targets(DOME)
    counts = set()
    for q in starts(PUMA, points[45], approaches[45], TASK.cone):
        smooth = greedy_check(PUMA, DOME, TASK, COARSE, start=q)
        meshed = greedy_check(PUMA, MESH, TASK, COARSE, start=q)
        assert smooth.start == meshed.start == 45
        assert (smooth.answer, smooth.evidence) == (meshed.answer, meshed.evidence)
        np.testing.assert_array_equal(smooth.covered, meshed.covered)
        counts.add(smooth.n_covered)
    assert counts == {60, 90}


@pytest.mark.parametrize("method", ["greedy", "complete"])
def test_a_case_file_has_either_answer(method: str) -> None:
    file = pathlib.Path(__file__).with_name("greedy_on_a_torus.toml")
    verdict = check(*load_case(file, [f"search.method={method}"]).build())
    assert (verdict.answer, verdict.method) == (Answer.FEASIBLE, method)
    assert verdict.n_covered == 9


def test_triangles_say_what_the_surface_says() -> None:
    """Heights, normals and cells within the stated deviations; on a mesh to rounding."""
    rng = np.random.default_rng(0)
    for cells in (RING, MESH):
        for height in (-0.02, 0.0, 0.03):
            made = triangulation(cells, height, 2e-3)
            some = rng.integers(len(cells), size=300)
            points = cells.centres[some] + height * cells.normals[some]
            points += 0.05 * rng.normal(size=points.shape)
            points -= (cells.surface.closest(points).height - height)[:, None] * (
                cells.surface.closest(points).normal
            )
            exact, where = cells.surface.closest(points), cells.locate(points)
            found = np.array([cell_under(made.kernel, *point) for point in points])
            over = found[:, 0] >= 0
            e = made.kernel.deviation + 1e-12
            assert np.abs(found[over, 1] - exact.height[over]).max() <= e
            assert np.linalg.norm(found[over, 2:] - exact.normal[over], axis=1).max() <= (
                made.turn + 1e-12
            )
            sure = over & (found[:, 0] < len(cells))
            np.testing.assert_array_equal(found[sure, 0], where[sure])
            assert sure.sum() > 100
            assert (where[sure.argmin()] == -1) or sure.mean() > 0.3
            assert (where[~over] == -1).all()


def test_beyond_the_border_of_a_mesh_there_is_no_cell() -> None:
    flat = plane((0.0, 0.4), (0.0, 0.4), side="outside").cells(2, 2)
    meshed = in_cells_of(flat, 3)
    points = np.array([[0.1, 0.1, 0.02], [-0.01, 0.1, 0.02], [0.41, 0.41, 0.0], [0.3, 0.401, 0.1]])
    assert meshed.locate(points).tolist() == flat.locate(points).tolist() == [0, -1, -1, -1]
    kernel = triangulation(meshed, 0.02, 1e-3).kernel
    assert [cell_under(kernel, *point)[0] for point in points] == [0, -1, -1, -1]


@pytest.mark.parametrize("cells", [RING, in_cells_of(RING, 6)])
def test_the_replay_of_a_tree_judges_between_jcells(cells) -> None:
    verdict = greedy_check(PUMA, cells, TASK, COARSE)
    assert verdict.feasible
    assert verdict.certificate is not None
    assert replay_stored(verdict, COARSE).accepted
    steps = Steps.of(PUMA, cells, TASK, COARSE)
    start = verdict.start
    paths = [Path(start, start, verdict.tree.nodes[start]["q"][None])]
    paths += [Path(a, b, motion) for a, b, motion in verdict.tree.edges(data="motion")]
    assert replay_tree(PUMA, cells, TASK, steps, paths).accepted
    points, axes = Kinematics(PUMA).tools(np.concatenate([path.q for path in paths]))
    found = cells.surface.closest(points)
    error = np.abs(found.height + TASK.standoff).max()
    assert error <= verdict.certificate.max_position_error + 1e-5 <= steps.tolerance
    tight = replace(steps, tolerance=0.95 * error)
    assert "off its surface" in replay_tree(PUMA, cells, TASK, tight, paths).refusal
    tilt = np.degrees(np.arccos(np.einsum("ki,ki->k", axes, found.normal))).max()
    narrow = replace(TASK, cone_deg=0.95 * tilt)
    assert "the tool axis tilts" in replay_tree(PUMA, cells, narrow, steps, paths).refusal
    swapped = paths[:1] + [replace(path, neighbour=path.cell) for path in paths[1:]]
    assert "in the cell it claims" in replay_tree(PUMA, cells, TASK, steps, swapped).refusal


def test_creases_are_named_and_not_crossed() -> None:
    arm, task = load_robot("ur5"), Task(0.005, 20, tolerance=1e-3)
    roof = mesh(TriangleMesh(*folded(17.0)), side="outside").cells(count=12)
    verdict = greedy_check(
        arm, roof, task, Search(method="greedy", step_deg=0.5, cap=300, starts=1)
    )
    assert verdict.answer is Answer.INFEASIBLE
    assert not (verdict.covered & roof.creased).any()
    assert verdict.covered.any()
    assert "where the surface is creased or most curved" in verdict.message
    slope = np.radians(10.0)
    sides = [
        plane((0, 0.2), (-0.1, 0.1), position=(0.35, 0, 0.2), rpy_deg=(0, -10, 0)),
        plane((0, 0.2), (-0.1, 0.1), rpy_deg=(0, 10, 0),
              position=(0.35 + 0.2 * np.cos(slope), 0, 0.2 + 0.2 * np.sin(slope))),
    ]  # fmt: skip
    halves = piecewise(sides, side="outside").cells((2, 2))
    verdict = greedy_check(
        arm, halves, task, Search(method="greedy", step_deg=0.2, cap=300, starts=1)
    )
    assert "4 pairs of cells on both sides of a crease were left out" in verdict.message
    owner = halves.piece[np.flatnonzero(verdict.covered)]
    assert len(set(owner.tolist())) == 1


def test_a_roll_that_is_limited_is_kept_between_jcells() -> None:
    cells = sphere(0.5, (15, 40), (-40, 40), position=(0.3, 0, -0.3), side="outside").cells(3, 3)
    task = Task(0.005, 45, roll_deg=(-20, 20), roll_reference=(1, 0, 0))
    verdict = greedy_check(PUMA, cells, task, COARSE)
    assert verdict.feasible, verdict.message
    walk = tree_walk(verdict)
    assert walk is not None
    share = np.linspace(0.0, 1.0, 5)[:-1, None, None]
    q = (walk.q[:-1] + share * np.diff(walk.q, axis=0)).reshape(-1, PUMA.n)
    kinematics = Kinematics(PUMA)
    points, axes = kinematics.tools(q)
    x = np.array([kinematics.rotation(row) @ PUMA.reference_axis for row in q])
    approaches = -cells.surface.closest(points).normal
    references, _ = projected(np.array([1.0, 0.0, 0.0]), approaches)
    rolls = np.degrees(roll_of(x, axes, references, approaches))
    assert np.abs(rolls).max() <= 20.0
    assert np.ptp(rolls) > 10.0
    assert verdict.certificate is not None
    assert verdict.certificate.max_roll is not None
    assert np.abs(rolls).max() <= np.degrees(verdict.certificate.max_roll) <= 20.0
    held = replace(task, roll_deg=(-5, 5))
    assert not greedy_check(PUMA, cells, held, COARSE).feasible
    assert not replay_stored(replace(verdict, task=held), COARSE).accepted
