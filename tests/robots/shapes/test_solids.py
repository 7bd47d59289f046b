"""What is a solid, of links and of objects alike: one definition."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from feasibility.collisions import Obstacle
from robots.shapes import Triangles, checked_triangles, solid_faces

BOX = trimesh.creation.box((1.0, 2.0, 3.0))
TURNED = np.concatenate([BOX.faces[:1, ::-1], BOX.faces[1:]])
CASES = {
    "a box": (BOX.vertices, BOX.faces, 6.0),
    "a box inside out": (BOX.vertices, BOX.faces[:, ::-1], 6.0),
    "mirrored": (BOX.vertices * [-1.0, 1.0, 1.0], BOX.faces, 6.0),
    "a face is missing": (BOX.vertices, BOX.faces[1:], None),
    "a face twice": (BOX.vertices, np.concatenate([BOX.faces, BOX.faces[:1]]), None),
    "a face turned over": (BOX.vertices, TURNED, 6.0),
    "two faces back to back": (BOX.vertices, np.array([[0, 1, 2], [0, 2, 1]]), None),
    "flat": (BOX.vertices * [1.0, 1.0, 1e-10], BOX.faces, None),
}


@pytest.mark.parametrize("name", CASES)
def test_links_and_objects_agree_on_what_is_a_solid(name: str) -> None:
    vertices, faces, volume = CASES[name]
    assert (solid_faces(np.asarray(vertices), faces) is None) == (volume is None)
    link = checked_triangles(vertices, faces)
    thing = Obstacle("a", Triangles(vertices, faces, False), np.eye(4)).geometry
    assert isinstance(thing, Triangles)
    assert link.closed == thing.closed == (volume is not None)
    if volume is not None:
        for one in (link, thing):
            body = trimesh.Trimesh(one.vertices, one.faces, process=False)
            assert body.is_winding_consistent
            assert body.volume == pytest.approx(volume)


def test_each_piece_of_a_tangled_body_looks_outwards() -> None:
    """Two boxes, all faces turned at random: 12 m^3."""
    rng = np.random.default_rng(0)
    faces = np.concatenate([BOX.faces, 8 + BOX.faces])
    faces = np.where(rng.random(24)[:, None] < 0.5, faces[:, ::-1], faces)
    body = checked_triangles(np.concatenate([BOX.vertices, BOX.vertices + 5.0]), faces)
    assert body.closed
    assert trimesh.Trimesh(body.vertices, body.faces).volume == pytest.approx(12.0)


def test_a_klein_bottle_is_a_sheet() -> None:
    """Closed, but no turning makes its faces agree."""
    n = 6
    number = np.arange(n * n).reshape(n, n)
    faces = []
    for i in range(n):
        for j in range(n):
            row = number[i + 1] if i + 1 < n else number[0, -np.arange(n)]  # joined the other way
            a, b = number[i, j], number[i, (j + 1) % n]
            c, d = row[j], row[(j + 1) % n]
            faces += [[a, b, d], [a, d, c]]
    points = np.random.default_rng(1).normal(size=(n * n, 3))
    assert solid_faces(points, np.array(faces)) is None
