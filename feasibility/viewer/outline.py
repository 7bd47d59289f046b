"""The outline of a surface, light enough to be drawn at hundreds of poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.placement import Pose
from feasibility.viewer.cell_meshes import patch
from surfaces import Cells, Triangles, components

Array = NDArray[np.float64]

MOST = 96  # segments of one outline
FINEST = 8  # pieces that a cell's side is cut into, at most
ALIKE = 1e-6  # [1] of the surface's size: corners nearer than this are one
SMALL = 0.5  # [1] of the surface's size: a smaller boundary does not show where the surface lies
STROKE = 0.12  # [1] of the surface's size: the stroke that points to the working side


def outline(cells: Cells) -> Array:
    """The boundary of a surface and a stroke from its middle to the working side.

    A surface without a boundary, or with a small one, shows its three middle sections as well.

    Returns:
        (k, 2, 3) m, ends of segments, in the surface's frame.
    """
    if len(cells) == 0:
        return np.empty((0, 2, 3))
    triangles = _triangles(cells)
    size = _size(triangles.vertices)
    lines = _boundary(triangles, ALIKE * size)
    if len(lines) == 0 or _size(lines.reshape(-1, 3)) < SMALL * size:
        lines = np.concatenate([lines, _sections(triangles)])
    lines = np.concatenate([_thinned(lines, size / MOST), _stroke(cells, STROKE * size)])
    return lines


def placed(points: Array, pose: Pose) -> Array:
    """Points (..., 3) m of the surface's frame in the root frame, for a surface at `pose`."""
    return points @ pose.rotation.T + np.array(pose.position)


def _triangles(cells: Cells) -> Triangles:
    """A few triangles of all cells, in the surface's frame."""
    every = np.arange(len(cells))
    if len(cells.shape) > 1:
        pieces = int(np.clip(MOST // (2 * sum(cells.shape)), 1, FINEST))
        found = cells.triangles(every, pieces)
    else:
        found = patch(cells, every)
    return found._replace(vertices=_in_own_frame(cells, found.vertices))


def _in_own_frame(cells: Cells, points: Array) -> Array:
    """Points (..., 3) m of the root frame in the surface's frame."""
    return np.asarray((points - cells.surface.position) @ cells.surface.rotation)


def _size(points: Array) -> float:
    """Diagonal of the box around points (k, 3), m."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _boundary(triangles: Triangles, near: float) -> Array:
    """(k, 2, 3) m: edges of one triangle only; corners nearer than `near` (m) are one."""
    from scipy.spatial import cKDTree

    vertices = triangles.vertices
    pairs = cKDTree(vertices).query_pairs(near, output_type="ndarray")
    place = components(pairs, len(vertices))
    faces = place[triangles.faces]
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges = edges[edges[:, 0] != edges[:, 1]]  # a side may have shrunk to a point, as at a pole
    found, number = np.unique(edges, axis=0, return_counts=True)
    _, first = np.unique(place, return_index=True)
    return np.asarray(vertices[first[found[number == 1]]])


def _sections(triangles: Triangles) -> Array:
    """(k, 2, 3) m: where the three planes through the middle cut the surface."""
    import trimesh

    body = trimesh.Trimesh(triangles.vertices, triangles.faces, process=False)
    # Slightly off the middle: a plane through corners cuts along edges, or nothing.
    share = np.array([0.5003, 0.4998, 0.5001])
    middle = body.bounds[0] + share * np.ptp(body.bounds, axis=0)
    cuts = [trimesh.intersections.mesh_plane(body, axis, middle) for axis in np.eye(3)]
    return np.concatenate([np.reshape(cut, (-1, 2, 3)) for cut in cuts])


def _thinned(lines: Array, spacing: float) -> Array:
    """At most `MOST` of some segments: ends in one box of a grid become one, at their mean."""
    result = lines
    while len(result) > MOST:
        boxes = np.floor(lines.reshape(-1, 3) / spacing).astype(np.int64)
        _, box, number = np.unique(boxes, axis=0, return_inverse=True, return_counts=True)
        box = box.reshape(-1)
        means = np.column_stack([np.bincount(box, x) / number for x in lines.reshape(-1, 3).T])
        ends = np.unique(np.sort(box.reshape(-1, 2), axis=1), axis=0)
        result = means[ends[ends[:, 0] != ends[:, 1]]]
        spacing *= 1.25
    return result


def _stroke(cells: Cells, length: float) -> Array:
    """(1, 2, 3) m: from the middle to the working side; (0, 2, 3) where normals cancel out."""
    mean = (cells.areas[:, None] * cells.normals).sum(axis=0) / cells.areas.sum()
    if np.linalg.norm(mean) < SMALL:
        return np.empty((0, 2, 3))
    away = np.linalg.norm(cells.centres - cells.centres.mean(axis=0), axis=1)
    cell = int(np.argmax(away <= away.min() + ALIKE * away.max()))  # the first of several as near
    # The tool is on the side of the targets.
    tip = cells.centres[cell] + length * cells.surface.side_sign * cells.normals[cell]
    return _in_own_frame(cells, np.stack([cells.centres[cell], tip]))[None]
