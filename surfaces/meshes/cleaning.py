"""Any triangle arrays into a clean mesh: safe repairs are made and noted, the rest is refused."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask
from coverable.errors import counted
from surfaces.meshes.degenerate import flipped, thin, weld_distance, welded
from surfaces.meshes.orientation import one_fan_each, oriented, place
from surfaces.meshes.triangle_mesh import TriangleMesh, areas_of, half_edge_ends, half_edges
from surfaces.surface import SurfaceError

FARTHEST = 1e6  # mesh diagonals from the origin; beyond it, coordinates have no digits to spare


def clean(vertices: ArrayLike, faces: ArrayLike, history: Sequence[str] = ()) -> TriangleMesh:
    """Check the triangles of a surface, repair what is safe, and note what was done.

    Repaired: vertices closer than a few ten-millionths of the mesh's diagonal become one;
    vertices without a face, faces without area and repeated faces go; faces that disagree with
    their neighbours about the outer side are turned over, so that the larger area of each piece
    stays as it is; a vertex at which several fans of faces touch is split. None of it moves the
    surface by more than a millionth of the diagonal. Separate pieces and holes stay, and are noted.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) whole numbers, counterclockwise seen from outside.
        history: what was done to the mesh before.

    Raises:
        SurfaceError: numbers that are not finite, indices out of range, more than two faces on an
            edge, a piece with only one side, or nothing left.

    Example:
        >>> mesh = clean([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], [[0, 1, 2]])
        >>> mesh
        TriangleMesh(1 faces, 0.5 m^2, 1 x 1 x 0 m)
        >>> mesh.history
        ('1 vertex that no face uses was dropped',)
    """
    points, corners = _checked(vertices, faces)
    notes = list(history)
    points, corners = _compact(points, corners, notes)
    distance = weld_distance(points)
    corners = _weld(points, corners, distance, notes)
    corners = _drop_repeated(points, corners, notes)
    corners = _manifold(points, corners, distance, notes)
    corners, turned = oriented(points, corners)
    if turned:
        notes.append(
            f"{counted(turned, 'face')} turned over, to face the same way as the larger part of "
            f"{'its' if turned == 1 else 'their'} piece"
        )
    corners, flips, dropped = flipped(points, corners, distance)
    if flips:
        notes.append(
            f"{counted(flips, 'face')} without area (thinner than {distance:.2g} m) mended by "
            "flipping the long edge"
        )
    if dropped:
        notes.append(f"{counted(dropped, 'face')} thinner than {distance:.2g} m dropped")
    corners = _kept(corners, np.ones(len(corners), bool), notes)
    points, corners, split = one_fan_each(points, corners)
    if split:
        notes.append(f"{counted(split, 'vertex', 'vertices')} added where pieces touch in a point")
    points, corners = _compact(points, corners, [])
    return TriangleMesh(points, corners, tuple(notes))


def _checked(vertices: ArrayLike, faces: ArrayLike) -> tuple[Array, Ints]:
    """The arrays, if they are a mesh at all; every fault is named."""
    try:
        points, numbers = np.array(vertices, dtype=float), np.array(faces)
    except (TypeError, ValueError, OverflowError) as error:
        raise SurfaceError(f"vertices and faces must be arrays of numbers: {error}") from error
    faults = []
    if points.ndim != 2 or points.shape[1] != 3:
        faults.append(f"vertices must have shape (V, 3) (metres), got {points.shape}")
    if numbers.ndim != 2 or numbers.shape[1] != 3 or not len(numbers):
        faults.append(f"faces must have shape (F, 3), at least one face, got {numbers.shape}")
    elif numbers.dtype.kind not in "iu":
        faults.append(f"faces must be whole numbers (indices of vertices), got {numbers.dtype}")
    if faults:
        raise SurfaceError(faults)
    outside = ((numbers < 0) | (numbers >= len(points))).any(axis=1)
    if outside.any():
        first = int(outside.argmax())
        raise SurfaceError(
            f"{counted(int(outside.sum()), 'face')} of {len(numbers)} name vertices that do not "
            f"exist; face {first} (counted from 0) has {numbers[first].tolist()}, and the vertices "
            f"are 0 .. {len(points) - 1}; the file is damaged or cut short, export it again"
        )
    corners = numbers.astype(np.int64)
    used = np.zeros(len(points), bool)
    used[corners] = True
    bad = used & ~np.isfinite(points).all(axis=1)
    if bad.any():
        first = int(bad.argmax())
        raise SurfaceError(
            f"{counted(int(bad.sum()), 'vertex', 'vertices')} of {len(points)} that faces use "
            f"{'is' if bad.sum() == 1 else 'are'} not finite, the first is vertex {first} (counted "
            f"from 0) at {points[first].tolist()}; remove or mend it where the mesh comes from"
        )
    _refuse_lost_digits(points[used])
    return points, corners


def _refuse_lost_digits(points: Array) -> None:
    """A mesh that is huge, a point, or far away has no digits for areas and normals."""
    farthest = float(np.abs(points).max())
    if farthest > 1e9:
        raise SurfaceError(
            f"a vertex lies {farthest:.3g} m from the origin; coordinates must be within 1e9 m"
        )
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    if diagonal < 1e-9:
        raise SurfaceError(
            f"the mesh is {diagonal:.3g} m across, which is no surface; give scale if its unit is "
            "not the metre"
        )
    if farthest > FARTHEST * diagonal:
        raise SurfaceError(
            f"the mesh is {diagonal:.3g} m across, but lies {farthest:.3g} m from its origin, too "
            f"far for exact normals (at most {FARTHEST:g} times its size); move it to its origin"
        )


def _compact(points: Array, corners: Ints, notes: list[str]) -> tuple[Array, Ints]:
    """Leave out vertices that no face uses; the others keep their order."""
    used = np.zeros(len(points), bool)
    used[corners] = True
    unused = len(points) - int(used.sum())
    if unused:
        notes.append(
            f"{counted(unused, 'vertex', 'vertices')} that no face uses "
            f"{'was' if unused == 1 else 'were'} dropped"
        )
    return points[used], (np.cumsum(used) - 1)[corners]


def _weld(points: Array, corners: Ints, distance: float, notes: list[str]) -> Ints:
    """Join vertices that are one point, and drop the faces that this leaves without corners."""
    representative = welded(points, distance)
    moved = (points[representative] != points).any(axis=1)
    joined = int((representative != np.arange(len(points))).sum())
    if joined:
        near = f", {moved.sum()} of them not equal but within {distance:.2g} m" * bool(moved.any())
        notes.append(
            f"{counted(joined, 'vertex', 'vertices')} that repeated others "
            f"{'was' if joined == 1 else 'were'} joined to them{near}"
        )
    corners = representative[corners]
    collapsed = (corners == np.roll(corners, 1, axis=1)).any(axis=1)
    if collapsed.any():
        notes.append(
            f"{counted(int(collapsed.sum()), 'face')} with two corners in one place dropped"
        )
    return _kept(corners, ~collapsed, notes)


def _drop_repeated(points: Array, corners: Ints, notes: list[str]) -> Ints:
    """Of faces with the same three corners, whatever their orientation, the first stays."""
    ordered = np.sort(corners, axis=1)
    ranks = np.lexsort(ordered.T[::-1])
    repeated = np.zeros(len(corners), bool)
    repeated[ranks[1:]] = (ordered[ranks[1:]] == ordered[ranks[:-1]]).all(axis=1)
    if repeated.any():
        area = areas_of(points, corners[repeated]).sum()
        notes.append(
            f"{counted(int(repeated.sum()), 'face')} ({area:.4g} m^2) that repeated others dropped"
        )
    return corners[~repeated]


def _manifold(points: Array, corners: Ints, distance: float, notes: list[str]) -> Ints:
    """Drop faces without area from edges with more than two faces, and refuse where that is not it.

    Such edges leave open on which side of which face the tool works.
    """
    halves = half_edges(corners)
    if (halves.counts <= 2).all():
        return corners
    bad = np.zeros(len(corners), bool)
    bad[halves.order[np.repeat(halves.counts, halves.counts) > 2] // 3] = True
    bad &= thin(points, corners, distance)
    if bad.any():
        notes.append(
            f"{counted(int(bad.sum()), 'face')} thinner than {distance:.2g} m dropped from "
            "edges with more than two faces"
        )
    corners = _kept(corners, ~bad, notes)
    halves = half_edges(corners)
    crowded = halves.counts > 2
    if crowded.any():
        first = int(crowded.argmax())
        a, b = points[half_edge_ends(corners, halves.order[halves.starts[first]])]
        raise SurfaceError(
            f"{counted(int(crowded.sum()), 'edge')} with more than two faces; the first runs from "
            f"{place(a)} to {place(b)} and has {halves.counts[first]}; keep only the surface "
            "to be covered: remove inner walls and doubled parts, and export it again"
        )
    return corners


def _kept(corners: Ints, kept: Mask, notes: list[str]) -> Ints:
    """The faces that are kept; refuses to keep none."""
    if not kept.any():
        raise SurfaceError(
            "no face with an area is left; " + "; ".join(notes) + "; export the surface again"
        )
    return corners[kept]
