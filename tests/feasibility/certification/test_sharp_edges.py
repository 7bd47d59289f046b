"""Motions over edges of meshes that once came nearer to the triangles than they may."""

from __future__ import annotations

import numpy as np
import pytest
from dense_replay import dense, tools
from test_creases import PER_SEGMENT, nearest, roof

from feasibility import Task, check, verify
from robots import load_robot
from surfaces import mesh

CASES = {
    "sharp, near": (roof(120), Task(0.02, 45, 3e-4), 20),
    "sharp, far": (roof(120), Task(0.05, 45, 3e-4), 20),
    "right": (roof(90), Task(0.05, 45, 3e-4), 20),
    "blunt": (roof(45), Task(0.02, 20, 3e-4), 12),
    "smooth": (roof(25), Task(0.03, 30, 1e-3), 12),
    "concave": (roof(-20), Task(0.03, 30, 1e-3), 12),
}


@pytest.mark.parametrize("name", CASES)
def test_a_certificate_bounds_how_far_a_motion_is_from_the_triangles(name: str) -> None:
    """By the exact distance; over a sharp edge the direction to it is inside the cone, too."""
    part, task, count = CASES[name]
    surface = mesh(part, position=(0.5, -0.15, 0.3))
    verdict = check(load_robot("ur5"), surface.cells(count), task)
    assert verdict.feasible
    assert verdict.witness is not None
    assert verdict.certificate is not None
    walk, certificate = verdict.witness, verdict.certificate
    tips, axes = tools(verdict.robot, dense(walk.q, PER_SEGMENT))
    closest = nearest(part.vertices[part.faces] + surface.position, tips)
    away = np.linalg.norm(tips - closest, axis=1)
    assert np.abs(away - task.standoff).max() <= certificate.max_position_error
    assert verify(verdict.robot, verdict.cells, task, walk.q).holds
    if name not in ("smooth", "concave"):  # where normals are interpolated
        cosine = ((closest - tips) * axes).sum(axis=1) / away
        assert np.arccos(np.clip(cosine, -1, 1)).max() <= task.cone + 1e-9


@pytest.mark.parametrize("angle", [95, 120, 150, 170])
def test_a_point_over_a_sharp_edge_is_outside(angle: int) -> None:
    """It may lie under the plane of either face."""
    surface = mesh(roof(angle)).cells(20).surface
    turn = np.radians(np.linspace(-0.49, 0.49, 25) * angle)
    over = np.column_stack([np.sin(turn), np.zeros(len(turn)), np.cos(turn)])
    for y in np.linspace(0.01, 0.29, 8):
        closest_point = surface.closest([0.0, y, 0.0] + 0.05 * over)
        np.testing.assert_allclose(closest_point.height, 0.05, rtol=1e-12)
        assert surface.closest([0.0, y, -0.01]).height < 0.0
