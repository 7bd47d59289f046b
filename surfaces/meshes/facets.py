"""Facets: triangles on each of which a mesh's normal has the direction of a quadratic polynomial.

On a face without creases the normal is along the mean of its corners' normals, which is linear. On
the strip along a crease it turns to that on the crease: there each corner's normal is a linear
function too, so the mean is quadratic. So a face with corners on a crease is cut into what lies off
the strip, and the strip, in some steps across.

A quadratic polynomial on a triangle lies in the hull of six coefficients: its values at the
corners, and 2 m - (a + b) / 2 for each side, with the values m in its middle and a, b at its ends.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.meshes.normals import WIDTH, crease_share

FEWEST, MOST = 2, 6  # triangles or pairs of them from the edge of a strip to its crease


class Facets(NamedTuple):
    """G triangles that together are the mesh."""

    corners: Array
    """(G, 3, 3) m."""
    normals: Array
    """(G, 6, 3) coefficients of a polynomial m, the normal being m / |m|: at the corners, and in
    the middles of the sides from each to the next."""
    off: Array
    """(G,) how far |m| may be from 1; inf where m may be 0."""


def facets_of(
    corners: Array, normals: Array, crease_normals: Array, on_crease: Mask, straight: float
) -> Facets:
    """Cut the faces of a mesh; see `MeshSurface` for its normals.

    Args:
        corners: (F, 3, 3) m.
        normals: (F, 3, 3) at the corners.
        crease_normals: (F, 3, 3) the same on creases.
        on_crease: (F, 3) which corners lie on one.
        straight: by how much the normal may turn on a step of a strip, about.
    """
    turns = np.linalg.norm(crease_normals - normals, axis=2)
    steps = float(np.clip(np.ceil(turns.max() / straight), FEWEST, MOST))
    face, weights = cut_faces(on_crease, int(steps))
    middles = (weights + np.roll(weights, -1, axis=1)) / 2.0
    at = np.concatenate([weights, middles], axis=1)
    own, turn = normals[face], (crease_normals - normals)[face]
    share = crease_share(on_crease[face, None], at)
    values = at @ own + share[..., None] * (at @ turn)
    ends = values[:, :3] + values[:, [1, 2, 0]]
    net = np.concatenate([values[:, :3], 2.0 * values[:, 3:] - ends / 2.0], axis=1)
    mean = net.mean(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    # |m| is at least its share along any direction, and that lies in the hull's.
    least = np.einsum("gkd,gd->gk", net, mean).min(axis=1)
    most = np.linalg.norm(net, axis=2).max(axis=1)
    known = least > 0.0
    scale = np.where(known, (least + most) / 2.0, 1.0)
    off = np.where(known, (most - least) / 2.0 / scale, np.inf)
    net /= scale[:, None, None]
    return Facets(weights @ corners[face], net, off)


def cut_faces(on: Mask, steps: int) -> tuple[Ints, Array]:
    """The face (G,) and the weights of the corners (G, 3, 3) of each facet.

    Args:
        on: (F, 3) which corners lie on a crease.
        steps: from the edge of a strip to its crease.
    """
    turn = np.linspace(0.0, WIDTH, steps + 1).tolist()
    # The share is 1 - (1 - w) / WIDTH with the weight w of the corner on the crease, ...
    at_corner = _bands([0.0, *(1.0 - w for w in reversed(turn))])
    # ... or 1 - w / WIDTH with the weight w of the one off it.
    at_edge = _bands([*turn, 1.0])
    count = on.sum(axis=1)
    whole = np.flatnonzero((count == 0) | (count == 3))
    faces, weights = [whole], [np.broadcast_to(np.eye(3), (len(whole), 3, 3))]
    for corners, shapes in ((1, at_corner), (2, at_edge)):
        some = np.flatnonzero(count == corners)
        # Turned so that the corner on the crease, or the one off it, is the first.
        first = np.argmax(on[some] == (corners == 1), axis=1)
        turned = (np.arange(3) - first[:, None]) % 3
        for shape in shapes:
            faces.append(some)
            weights.append(np.take_along_axis(
                np.broadcast_to(shape, (len(some), 3, 3)), turned[:, None], axis=2
            ))  # fmt: skip
    return np.concatenate(faces), np.concatenate(weights)


def _bands(ends: list[float]) -> Array:
    """(n, 3, 3) triangles between lines of equal weight of the first corner, given in order."""
    made = []
    for low, high in pairwise(ends):
        a, b = (np.array([[w, 1.0 - w, 0.0], [w, 0.0, 1.0 - w]]) for w in (low, high))
        if high < 1.0:
            made.append([a[0], b[1], b[0]])
        made.append([a[0], a[1], b[1]])
    return np.array(made)
