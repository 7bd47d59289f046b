"""A check that holds for the shapes of every arm."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from robots.shapes import LinkShapes, Triangles
from robots.urdf import Cylinder

SAMPLES = 400  # vertices of a mesh


def assert_held(shapes: LinkShapes) -> None:
    """Every point of every solid is in one of the polytopes of its link."""
    for solid in shapes.solids:
        points = _points(solid.geometry)
        if points is None:  # exact hulls: their own tests
            continue
        points = points @ solid.placement[:3, :3].T + solid.placement[:3, 3]
        out = np.full(len(points), np.inf)
        for body in shapes.polytopes:
            if (body.owner, body.joint) != (solid.owner, solid.joint) or len(body.vertices) < 4:
                continue
            planes = _planes(body.vertices)
            # Never more than the distance from the body.
            beyond = (points @ planes[:, :3].T + planes[:, 3]).max(axis=1) - body.radius
            out = np.minimum(out, beyond)
        assert out.max() <= 1e-9, f"{solid.owner}: {out.max()} m outside"


def _planes(vertices: np.ndarray) -> np.ndarray:
    try:
        return ConvexHull(vertices).equations
    except QhullError as error:
        raise AssertionError("a polytope without a volume") from error


def _points(shape: object) -> np.ndarray | None:
    if isinstance(shape, Triangles):
        rng = np.random.default_rng(0)
        return np.asarray(shape.vertices[rng.permutation(len(shape.vertices))[:SAMPLES]])
    if isinstance(shape, Cylinder):
        angle = np.linspace(0, 2 * np.pi, 100)
        rim = shape.radius * np.column_stack([np.cos(angle), np.sin(angle)])
        ends = (-shape.length / 2, shape.length / 2)
        return np.concatenate([np.column_stack([rim, np.full(100, z)]) for z in ends])
    return None
