"""The paper's cases as meshes: exported to STL, loaded back, and judged like the patches."""

from __future__ import annotations

import mesh_patches
import numpy as np
import pytest
from mesh_writers import stl

from feasibility import Task, check
from feasibility.cases import load_case
from feasibility.certification import replay
from robots import load_robot
from surfaces import mesh
from surfaces.meshes.cells import MeshCells

CASES = ["4a", "4d", "5e"]
MORE = ["4b", "4c", "4e", "4f", "5a", "5b", "5c", "5d", "5f"]  # make campaign NAME=larger_samples
FINE = (90, 100)  # rows and columns of facets


def stl_of(patch, path):
    """A patch as a binary STL file, corners to single precision, faces looking outward."""
    path.write_bytes(stl(*mesh_patches.of_patch(patch, *FINE)))
    return path


def share(verdict):
    """Covered share of the area."""
    return verdict.cells.areas[verdict.covered].sum() / verdict.cells.areas.sum()


def assert_same_answer(verdict, original):
    """Answer and evidence; a witness visits every cell, and the replay has accepted it."""
    assert (verdict.answer, verdict.evidence) == (original.answer, original.evidence)
    if verdict.feasible:
        needed = np.ones(len(verdict.cells), dtype=bool)
        outcome = replay(verdict.robot, verdict.cells, verdict.task, verdict.witness, needed)
        assert outcome.accepted
        assert outcome.certificate.max_position_error <= 1e-3


@pytest.mark.parametrize("name", CASES)
def test_a_case_as_a_mesh_has_the_same_answer(name, tmp_path):
    """Cut into as many cells of its own, and into the very cells of the patch.

    Its own cells lie elsewhere, so the covered share is compared, within 3 per cent of the area;
    the cells of the patch are covered or missed one by one as they are there.
    """
    robot, cells, task, _ = load_case(f"paper/{name}").build()
    original = check(robot, cells, task)
    surface = mesh(stl_of(cells.surface, tmp_path / "patch.stl"), side=cells.surface.side)
    assert surface.mesh.area == pytest.approx(cells.areas.sum(), rel=1e-3)

    own = check(robot, surface.cells(len(cells)), task)
    assert_same_answer(own, original)
    assert share(own) == pytest.approx(share(original), abs=0.03)

    triangles = surface.mesh
    fine = surface.finer(triangles.vertices, triangles.faces, np.arange(len(triangles.faces)))
    labels = cells.locate(triangles.vertices[triangles.faces].mean(axis=1))
    alike = check(robot, MeshCells.of(fine, labels), task)
    assert_same_answer(alike, original)
    np.testing.assert_array_equal(alike.covered, original.covered)
    assert [cause.kind for cause in alike.causes] == [cause.kind for cause in original.causes]


def test_the_search_works_no_harder_on_a_mesh(tmp_path):
    """Evaluations of the arm, 4a: at most twice those on the patch with the same cells."""
    robot, cells, task, _ = load_case("paper/4a").build()
    surface = mesh(stl_of(cells.surface, tmp_path / "patch.stl"), side="inside")
    own = check(robot, surface.cells(len(cells)), task)
    assert own.statistics["fk"] <= 2 * check(robot, cells, task).statistics["fk"]


def test_a_rigid_motion_of_arm_and_mesh_changes_nothing(tmp_path):
    """The ball's patch turned about the arm's first axis, and the limits with it."""
    robot, cells, task, _ = load_case("paper/4a").build()
    surface = mesh(stl_of(cells.surface, tmp_path / "patch.stl"), side="inside")
    angle = 0.3
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]]
    )
    limits = np.column_stack([robot.lower, robot.upper])
    limits[0] += angle
    one = check(robot, surface.cells(40), task)
    other = check(robot.with_limits(limits), surface.moved(turn, np.zeros(3)).cells(40), task)
    assert one.feasible
    assert other.feasible
    assert one.n_edges == other.n_edges


def box_mesh():
    """A closed box of twelve triangles."""
    made = mesh_patches.box()
    from surfaces.meshes import TriangleMesh

    return TriangleMesh(0.2 * made.vertices, made.faces)


def test_a_closed_box_is_covered_or_told_why():
    """All six sides, over its edges; `test_creases.py` looks at such motions again."""
    robot = load_robot("ur5")
    surface = mesh(box_mesh(), side="outside", position=(0.45, -0.05, 0.25))
    cells = surface.cells(60)
    assert "folded over a crease" in " ".join(cells.notes)
    verdict = check(robot, cells, Task(standoff=0.02, cone_deg=30))
    assert verdict.feasible
    stiff = check(robot, cells, Task(standoff=0.02, cone_deg=1e-3))
    assert not stiff.feasible
    assert "crease" in stiff.message or "proved" in stiff.message


def test_a_dent_smaller_than_the_standoff_folds_and_is_said_so():
    """A groove of 30 mm radius, and a standoff of 50 mm."""
    from surfaces.meshes import TriangleMesh

    u, v, faces = mesh_patches.grid(120, 40)
    angle = np.pi * (u - 0.5)
    groove = np.stack([0.03 * np.sin(angle), 0.3 * (v - 0.5), -0.03 * np.cos(angle)], axis=1)
    surface = mesh(TriangleMesh(groove, faces), side="inside", position=(0.5, 0.0, 0.3))
    centre = surface.mesh.face_normals.mean(axis=0)
    side = "outside" if centre[2] > 0.0 else "inside"  # the hollow side looks up
    surface = mesh(surface.mesh, side=side, position=(0.5, 0.0, 0.3))
    robot = load_robot("ur5")
    near = check(robot, surface.cells(40), Task(standoff=0.01, cone_deg=80))
    far = check(robot, surface.cells(40), Task(standoff=0.05, cone_deg=80))
    assert "folds" not in near.message
    assert far.answer == "undecided"
    assert "folds" in far.message
