"""Places of faces with their normals, compiled; how normals turn is said in `meshes.normals`."""

from __future__ import annotations

import numpy as np

from coverable.kernels import entry
from surfaces.meshes.normals import WIDTH


@entry
def normals_on_faces(own, crease, on_crease, faces, weights, normals):  # type: ignore[no-untyped-def]
    """Write unit normals at places of faces.

    Args:
        own: (F, 3, 3) at the corners.
        crease: (F, 3, 3) the same on creases.
        on_crease: (F, 3) corners that lie on one.
        faces: (k,)
        weights: (k, 3) of the faces' corners.
        normals: (k, 3) receives them.
    """
    for row in range(faces.shape[0]):
        f, along, square = faces[row], 0.0, 0.0
        for c in range(3):
            along += weights[row, c] * on_crease[f, c]
        share = min(max(1.0 - (1.0 - along) / WIDTH, 0.0), 1.0)
        for k in range(3):
            value = 0.0
            for c in range(3):
                turned = own[f, c, k] + share * (crease[f, c, k] - own[f, c, k])
                value += weights[row, c] * turned
            normals[row, k] = value
            square += value * value
        length = np.sqrt(square)
        for k in range(3):
            normals[row, k] /= length


@entry
def heights_over_faces(corners, points, faces, weights, normals, off, heights):  # type: ignore[no-untyped-def]
    """Write what leads from places of faces to points.

    Args:
        corners: (F, 3, 3) m.
        points: (k, 3) m.
        faces: (k,)
        weights: (k, 3) of the faces' corners.
        normals: (k, 3) outward, at the places.
        off: (k, 3) m, receives the vectors from the places to the points.
        heights: (k,) m, receives their lengths, negative where they lead inwards.
    """
    for row in range(faces.shape[0]):
        f, square, outwards = faces[row], 0.0, 0.0
        for k in range(3):
            place = 0.0
            for c in range(3):
                place += weights[row, c] * corners[f, c, k]
            off[row, k] = points[row, k] - place
            square += off[row, k] * off[row, k]
            outwards += off[row, k] * normals[row, k]
        heights[row] = np.sqrt(square) if outwards >= 0.0 else -np.sqrt(square)
