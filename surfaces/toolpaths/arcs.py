"""Curves from pose to pose: points run straight, and directions along the great arc.

As cubics: a straight line is one, and of a great arc cubics with its directions and slopes at both
ends of pieces of at most 15 degrees are within angle^4 / 384 (1.2e-5).

As parts with rigorous bounds, they are formulas over boxes, like those of surfaces. The second
parameter of these parts changes nothing.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from coverable.arrays import Array, Ints
from surfaces.cell_curves import CellCurves
from surfaces.enclosures import Enclosure
from surfaces.part_growth import Boxes, grown
from surfaces.parts import PartModels, SurfaceParts
from surfaces.patches.box_models import over_boxes

PIECE = math.radians(15.0)
ROUNDING = 1.0 + 1e-12  # covers the rounding of the few operations on derivative bounds
ROUNDING_OF_DIRECTIONS = 1e-14  # [1], of directions, by rounding


def arc_angles(starts: Array, ends: Array) -> Array:
    """(k,) rad, between unit vectors (k, 3)."""
    across = np.linalg.norm(np.cross(starts, ends), axis=-1)
    return np.asarray(np.arctan2(across, (starts * ends).sum(axis=-1)))


def arc_at(starts: Array, ends: Array, t: Array) -> tuple[Array, Array]:
    """Directions (k, 3) at t (k,) of the great arcs from unit vectors to others, and slopes by t.

    The ends must not be opposite.
    """
    angle = arc_angles(starts, ends)[:, None]
    across = ends - (starts * ends).sum(axis=1, keepdims=True) * starts
    across = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    turned = angle * t[:, None]
    cos, sin = np.cos(turned), np.sin(turned)
    return cos * starts + sin * across, angle * (cos * across - sin * starts)


def arc_pieces(directions: Array, pairs: Ints) -> Ints:
    """(M,) into how many cubics of at most 15 degrees the great arc of each pair is cut."""
    angle = arc_angles(directions[pairs[:, 0]], directions[pairs[:, 1]])
    return np.maximum(np.ceil(angle / PIECE), 1.0).astype(np.int64)


def straight(points: Array, pairs: Ints, first: Ints) -> Array:
    """(P, 4, 3) m, cubics of the straight lines between pairs (M, 2) of points (N, 3) m.

    `first` (M + 1,) is where the pieces of each line begin.
    """
    count = np.diff(first)
    owner = np.repeat(np.arange(len(pairs)), count)
    begin = (np.arange(len(owner)) - first[owner]) / count[owner]
    start = points[pairs[owner, 0]]
    along = points[pairs[owner, 1]] - start
    cubics = np.zeros((len(owner), 4, 3))
    cubics[:, 0] = start + begin[:, None] * along
    cubics[:, 1] = along / count[owner][:, None]
    return cubics


def curves(points: Array, directions: Array, pairs: Ints, count: Ints) -> CellCurves:
    """The curves between pairs (M, 2) of poses, each cut into `count` (M,) cubics.

    Points (N, 3) are in m. Directions (N, 3), the "normals" of the curves, are unit vectors, those
    of a pair not opposite.
    """
    first = np.concatenate([[0], np.cumsum(count)])
    owner = np.repeat(np.arange(len(pairs)), count)
    begin = (np.arange(len(owner)) - first[owner]) / count[owner]
    share = (1.0 / count)[owner]
    i, j = pairs.T
    ends = directions[i[owner]], directions[j[owner]]
    (d0, m0), (d1, m1) = arc_at(*ends, begin), arc_at(*ends, begin + share)
    m0, m1 = share[:, None] * m0, share[:, None] * m1
    turns = np.stack([d0, m0, 3.0 * (d1 - d0) - 2.0 * m0 - m1, 2.0 * (d0 - d1) + m0 + m1], axis=1)
    bent = 2.0 * turns[:, 2], 2.0 * turns[:, 2] + 6.0 * turns[:, 3]
    bounds = np.zeros((len(owner), 2))
    bounds[:, 1] = np.max([np.linalg.norm(one, axis=1) for one in bent], axis=0)
    bounds[:, 1] *= ROUNDING * count[owner] ** 2
    deviations = np.zeros((len(pairs), 2))
    angles = arc_angles(directions[i], directions[j]) / count
    deviations[:, 1] = angles**4 / 384.0 + ROUNDING_OF_DIRECTIONS
    cubics = np.concatenate([straight(points, pairs, first), turns], axis=2)
    none = np.zeros(len(owner), dtype=bool)
    return CellCurves(first, cubics, bounds, deviations, none, np.zeros(len(deviations)))


def curve_parts(
    points: Array, normals: Array, pairs: Ints, flat: float, straight: float, most: int
) -> SurfaceParts:
    """The tree of the parts, at most `most`, of the curves between pairs (M, 2), M >= 1, of poses.

    Points (N, 3) are in m, normals (N, 3) unit; `flat` (m) and `straight` are the largest r_f and
    r_n wanted.
    """
    count = len(pairs)
    bounds = partial(_models, points[pairs], normals[pairs])
    whole = Boxes(bounds, np.arange(count), np.zeros((count, 2)), np.ones((count, 2)))
    return grown(whole, flat, straight, most)


def _models(points: Array, normals: Array, which: Ints, low: Array, high: Array) -> PartModels:
    """Models of pieces of curves between points and normals (M, 2, 3): low to high of each."""
    start, end = points[which, 0], points[which, 1]
    first, last = normals[which, 0], normals[which, 1]
    angle = arc_angles(first, last)
    _, ahead = arc_at(first, last, np.zeros(len(which)))
    ahead = ahead / np.maximum(angle, 1e-300)[:, None]

    def formula(t: Enclosure, _: Enclosure) -> tuple[Enclosure, Enclosure]:
        turned = (angle * t)[..., None]
        return start + t[..., None] * (end - start), np.cos(turned) * first + np.sin(turned) * ahead

    models, _ = over_boxes(formula, low, high)
    return models
