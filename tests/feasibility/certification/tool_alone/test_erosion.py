"""What an erosion leaves has the whole ball around it inside the shape."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from tool_scenes import bracket

from feasibility.certification.tool_alone.erosion import eroded, planes_around
from robots.shapes import Triangles, checked_triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

BY = 0.02


@pytest.mark.parametrize(
    ("shape", "left"),
    [
        (Box((0.2, 0.3, 0.05)), Box((0.16, 0.26, 0.01))),
        (Sphere(0.1), Sphere(0.08)),
        (Capsule(0.05, 0.2), Capsule(0.03, 0.2)),
        (Cylinder(0.08, 0.1), Cylinder(0.06, 0.06)),
        (Box((0.2, 0.3, 0.03)), None),
        (Sphere(0.02), None),
        (Capsule(0.01, 1.0), None),
        (Cylinder(0.1, 0.04), None),
        (Cylinder(0.01, 1.0), None),
    ],
)
def test_primitives_are_eroded_in_closed_form(shape: object, left: object) -> None:
    found = eroded(shape, BY)
    if left is None:
        assert found is None
        return
    assert type(found) is type(left)
    numbers = [np.array([getattr(one, name) for name in one.__slots__]) for one in (found, left)]
    np.testing.assert_allclose(np.hstack(numbers[0]), np.hstack(numbers[1]))


@pytest.mark.parametrize(
    "body",
    [
        trimesh.creation.box((0.2, 0.3, 0.1)),
        trimesh.creation.icosphere(subdivisions=1, radius=0.1),
        trimesh.creation.cone(0.1, 0.2, sections=8),
    ],
    ids=["box", "ball", "cone"],
)
def test_a_convex_mesh_keeps_what_is_deep_enough(body: trimesh.Trimesh) -> None:
    mesh = checked_triangles(body.vertices, body.faces)
    found = eroded(mesh, BY)
    assert isinstance(found, Triangles)
    depths = [
        min(np.dot(corner - point, normal) for corner, normal in _faces(body))
        for point in found.vertices
    ]
    assert min(depths) >= BY - 1e-9
    assert min(depths) <= BY + 1e-6  # no more is taken than that
    assert eroded(mesh, 0.2) is None


def _faces(body: trimesh.Trimesh) -> list[tuple[np.ndarray, np.ndarray]]:
    """A corner and the outward normal of each face."""
    return list(zip(body.triangles[:, 0], body.face_normals, strict=True))


def test_of_other_meshes_nothing_is_known_to_be_left() -> None:
    assert planes_around(bracket()) is None
    assert eroded(bracket(), 0.001) is None
    box = trimesh.creation.box((0.2, 0.3, 0.1))
    assert eroded(Triangles(box.vertices, box.faces[1:], False), 0.001) is None
    # A box with a hole as thin as a hair down to its middle is no box.
    dented = box.subdivide().subdivide()
    corners = dented.vertices.copy()
    corners[np.linalg.norm(corners - [0.0, 0.0, 0.05], axis=1).argmin(), 2] = 0.0
    assert planes_around(checked_triangles(corners, dented.faces)) is None


def test_open_hollow_and_doubled_meshes_are_told_from_solids() -> None:
    """Each by one thing alone: a missing triangle, what is inside, or the volume."""
    box = trimesh.creation.box((0.2, 0.3, 0.1))
    planes = planes_around(Triangles(box.vertices, box.faces, True))
    assert planes is not None
    # Not even by rounding do they hold what is not in the box.
    assert (box.vertices @ planes[:, :3].T + planes[:, 3]).max(axis=1).min() > 0.0
    # A triangle at the corner that volumes are seen from adds nothing to the volume.
    beside = [k for k, face in enumerate(box.faces) if k and box.faces[0, 0] in face]
    for k in beside:
        assert planes_around(Triangles(box.vertices, np.delete(box.faces, k, 0), False)) is None
    inside = trimesh.creation.box((0.1, 0.1, 0.05))
    both = np.vstack([inside.faces, inside.faces[:, ::-1]]) + len(box.vertices)
    corners = np.vstack([box.vertices, inside.vertices])
    assert planes_around(Triangles(corners, np.vstack([box.faces, both]), True)) is None
    twice = np.vstack([box.faces, box.faces[:, ::-1]])
    assert planes_around(Triangles(box.vertices, twice, True)) is None
