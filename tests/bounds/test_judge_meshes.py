"""Motions over meshes, looked at by the exact distance from the triangles, given and not cut.

Over a convex edge the tool goes round in an arc of the standoff. The closest point of a convex body
gives the true approach direction too: from the tool point to that point.
"""

import mesh_patches
import numpy as np
import pytest
import trimesh
from bounds import holds
from gantry import configurations, gantry
from mesh_patches import roof
from referee import Facets
from referee import evenly as dense
from samples import sampled, spread

from coverable import Task, check, load_robot, mesh, verify
from feasibility.certification.motion_replay import replay_over_surface
from robots.kinematics import Kinematics
from surfaces.meshes.triangle_mesh import TriangleMesh

UR5 = load_robot("ur5")
AT = (0.5, -0.15, 0.3)


def without_bottom(body):
    kept = trimesh.Trimesh(body.vertices, body.faces[body.face_normals[:, 2] > -0.5])
    return TriangleMesh(kept.vertices, kept.faces)


def nearest(part, points):
    """(k, 3) closest points on triangles; and (k,) m how far they are."""
    facets = Facets(part.vertices, part.faces, True)
    closest = facets.at(*facets.nearest(points)).points
    return closest, np.linalg.norm(closest - points, axis=1)


BOX = without_bottom(trimesh.creation.box((0.3, 0.3, 0.2)))
ROUNDED = TriangleMesh(*mesh_patches.folded_sheet(0.02, 5))
EDGES = {  # part, place, task, cells, what normals lean by from the facets' own
    "sharp": (roof(120), AT, Task(0.02, 45, 3e-4), 20, 0.0),
    "right, far": (roof(90), AT, Task(0.1, 60), 20, 0.0),
    "blunt": (roof(45), AT, Task(0.02, 20, 3e-4), 12, 0.0),
    "smooth": (roof(25), AT, Task(0.03, 30, 1e-3), 12, np.radians(25)),
    "concave": (roof(-20), AT, Task(0.03, 30, 1e-3), 12, np.radians(20)),
    "rounded": (ROUNDED, (0.45, -0.15, -0.2), Task(0.15, 20, 1e-3), 60, np.pi / 20),
    "box": (BOX, (0.5, 0, 0.2), Task(0.005, 45), 40, 0.0),
}


@sampled("name", spread([*EDGES], 6))  # rounded is left out
def test_a_motion_over_edges_keeps_standoff_and_cone(name):
    part, position, task, count, lean = EDGES[name]
    robot = load_robot("ur10") if name == "rounded" else UR5
    verdict = check(robot, mesh(part, position=position).cells(count), task)
    assert verdict.feasible
    assert verify(robot, verdict.cells, task, verdict.witness.q).holds
    tips, axes = Kinematics(robot).tools(dense(verdict.witness.q, 8))
    closest, away = nearest(part, tips - position)
    assert np.abs(away - task.standoff).max() <= verdict.certificate.max_position_error
    assert verdict.certificate.max_position_error <= task.effective_tolerance
    cosine = ((closest + position - tips) * axes).sum(axis=1) / away
    assert np.arccos(np.clip(cosine, -1, 1)).max() <= task.cone + lean + 1e-6


def test_the_figure_of_a_motion_over_a_mesh_is_that_of_its_triangles():
    """Normals are interpolated: at its targets the tool is nearer to the triangles than 30 mm."""
    part = roof(-20)
    surface, foot = mesh(part), np.linspace(-0.2, 0.2, 401)[:, None] * np.eye(3)[:1]
    foot = foot + [0.0, 0.15, 0.0] + np.abs(foot[:, :1]) * [0.0, 0.0, np.tan(np.radians(10))]
    normal = surface.closest(foot).normal
    q = configurations(foot + 0.03 * normal, -normal)
    cells, task = surface.cells(12), Task(0.03, 30, 1e-3)
    found = replay_over_surface(gantry(), cells, task, q, np.zeros(len(cells), dtype=bool))
    assert found.accepted, found.refusal
    away = nearest(part, Kinematics(gantry()).tools(dense(q, 8))[0])[1]
    holds(found.certificate.max_position_error, task.standoff - away.min(), 0.9)


@pytest.mark.parametrize(("standoff", "answer"), [(0.05, "undecided"), (0.0, "feasible")])
def test_a_concave_edge_folds_unless_it_is_touched(standoff, answer):
    """In a trough the tool would have to be in two places: at its distance from either side."""
    verdict = check(UR5, mesh(roof(-60), position=AT).cells(24), Task(standoff, 60))
    assert verdict.answer == answer
    said = "concave" in verdict.message or "nearer than the standoff" in verdict.message
    assert said == (answer == "undecided")
