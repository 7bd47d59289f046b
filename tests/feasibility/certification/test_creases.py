"""Motions over sharp edges and tight bends, looked at by the exact distance from the triangles.

Over a convex edge the tool goes round in an arc of the standoff. The closest point of a convex body
gives the true approach direction too: from the tool point to that point.
"""

from __future__ import annotations

import mesh_patches
import numpy as np
import pytest
import trimesh
from dense_replay import dense, tools
from trimesh.triangles import closest_point

from feasibility import Answer, Task, check
from robots import load_robot
from surfaces.meshes import TriangleMesh, mesh

PER_SEGMENT = 10


def roof(angle_deg):
    """Two plates of 300 mm; the normal turns by the angle at their edge."""
    half = np.radians(angle_deg) / 2
    x, z = 0.3 * np.cos(half), -0.3 * np.sin(half)
    vertices = [[0, 0, 0], [0, 0.3, 0], [x, 0, z], [x, 0.3, z], [-x, 0, z], [-x, 0.3, z]]
    return TriangleMesh(np.array(vertices), [[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4]])


def without_bottom(body):
    """The faces of a body that do not look down."""
    kept = trimesh.Trimesh(body.vertices, body.faces[body.face_normals[:, 2] > -0.5])
    return TriangleMesh(kept.vertices, kept.faces)


PARTS = {
    "gable": (roof(45), (0.5, -0.15, 0.3), 36),
    "edge": (roof(90), (0.5, -0.15, 0.3), 36),
    "blade": (roof(120), (0.5, -0.15, 0.3), 36),
    "box": (without_bottom(trimesh.creation.box((0.3, 0.3, 0.2))), (0.5, 0, 0.2), 70),
    "nut": (without_bottom(trimesh.creation.cylinder(0.2, 0.2, sections=6)), (0.55, 0, 0.1), 70),
}
TASKS = {
    "near": Task(standoff=0.005, cone_deg=45),
    "tight": Task(standoff=0.02, cone_deg=35, tolerance=0.0005),
    "far": Task(standoff=0.1, cone_deg=60),
}


def nearest(triangles, points):
    """Closest points (k, 3) on triangles (m, 3, 3), trying each."""
    best, closest = np.full(len(points), np.inf), np.empty_like(points)
    for corners in triangles:
        found = closest_point(np.repeat(corners[None], len(points), axis=0), points)
        away = np.linalg.norm(found - points, axis=1)
        nearer = away < best
        best[nearer], closest[nearer] = away[nearer], found[nearer]
    return closest


MORE_EDGES = [("box", "tight"), ("edge", "far"), ("nut", "far")]
"""In `make campaign NAME=larger_samples`, as MORE_ROUNDED below."""


@pytest.mark.parametrize(
    ("name", "task"), [*((name, "near") for name in PARTS), ("gable", "tight"), ("box", "far")]
)
def test_a_motion_over_edges_keeps_standoff_and_cone(name, task):
    part, position, count = PARTS[name]
    task = TASKS[task]
    verdict = check(load_robot("ur5"), mesh(part, position=position).cells(count), task)
    assert_held(verdict, part, position, 1e-6)


def assert_held(verdict, part, position, lean):
    """A motion over all cells, at the standoff and in the cone, but for `lean` rad."""
    assert verdict.feasible
    walk, task = verdict.witness, verdict.task
    tips, axes = tools(verdict.robot, dense(walk.q, PER_SEGMENT))
    closest = nearest(part.vertices[part.faces] + position, tips)
    away = np.linalg.norm(tips - closest, axis=1)
    tolerance = 1e-3 if task.tolerance is None else task.tolerance
    assert np.abs(away - task.standoff).max() <= tolerance
    cosine = ((closest - tips) * axes).sum(axis=1) / away
    assert np.arccos(np.clip(cosine, -1, 1)).max() <= task.cone + lean
    assert set(walk.cell[walk.cell >= 0].tolist()) == set(range(len(verdict.cells)))


ROUNDED = [(0.006, 20, 0.15, 5e-3), (0.02, 5, 0.15, 1e-3)]
MORE_ROUNDED = [(0.006, 5, 0.03, 2e-3), (0.006, 20, 0.03, 1e-3), (0.02, 20, 0.15, 1e-3)]


@pytest.mark.parametrize(("radius", "facets", "standoff", "tolerance"), ROUNDED)
def test_a_motion_over_a_rounded_edge_far_smaller_than_the_standoff(
    radius, facets, standoff, tolerance
):
    part, position = TriangleMesh(*mesh_patches.folded_sheet(radius, facets)), (0.45, -0.15, -0.2)
    task = Task(standoff=standoff, cone_deg=20, tolerance=tolerance)
    verdict = check(load_robot("ur10"), mesh(part, position=position).cells(60), task)
    # Normals are interpolated: they lean from the facets' own by half a facet's turn.
    assert_held(verdict, part, position, np.pi / 4 / facets)


@pytest.mark.parametrize("standoff", [0.01, 0.05])
def test_a_concave_edge_folds(standoff):
    """In a trough the tool would have to be in two places: at its distance from either side."""
    surface = mesh(roof(-60), position=(0.5, -0.15, 0.3))
    verdict = check(load_robot("ur5"), surface.cells(36), Task(standoff=standoff, cone_deg=60))
    assert verdict.answer is Answer.UNDECIDED
    assert "concave" in verdict.message or "nearer than the standoff" in verdict.message


def test_a_concave_edge_that_is_touched_is_no_hindrance():
    """Without a standoff the tool point stays on the surface, and the axis turns on the edge."""
    surface = mesh(roof(-60), position=(0.5, -0.15, 0.3))
    verdict = check(load_robot("ur5"), surface.cells(36), Task(standoff=0.0, cone_deg=60))
    assert verdict.feasible
