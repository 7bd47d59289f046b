"""Parts of a mesh: in a box, beyond a plane, faces by direction, or faces by number."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask, unit_along
from coverable.errors import Fault, shown
from surfaces.arguments import Checks
from surfaces.meshes.degenerate import weld_distance
from surfaces.meshes.orientation import one_fan_each
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.surface import SurfaceError


def cut_plane(mesh: TriangleMesh, point: ArrayLike, normal: ArrayLike) -> TriangleMesh:
    """Keep what lies on the side of a plane to which its normal points.

    Triangles that the plane crosses are cut along it. A vertex nearer to it than a millionth of
    the mesh's diagonal counts as lying on it, so that no slivers arise.

    Args:
        mesh: what is cut.
        point: (3,) m, any point of the plane.
        normal: (3,) of any length.

    Raises:
        SurfaceError: bad numbers, or nothing is left.

    Example:
        >>> from surfaces.meshes.cleaning import clean
        >>> mesh = clean([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> cut_plane(mesh, point=(0, 0.5, 0), normal=(0, 1, 0))
        TriangleMesh(1 faces, 0.125 m^2, 0.5 x 0.5 x 0 m)
    """
    through, direction = checked_plane(point, normal)
    vertices, faces = _clipped(mesh, through, direction)
    where = f"the plane through {_listed(through)} with normal {_listed(direction)}"
    note = f"cut by {where}: {{faces}} faces, {{area:.4g}} of {{before:.4g}} m^2 kept"
    return _part(mesh, vertices, faces, f"nothing lies beyond {where}", note)


def cut_box(mesh: TriangleMesh, low: ArrayLike, high: ArrayLike) -> TriangleMesh:
    """Keep what lies in a box along the axes; triangles are cut along its sides.

    Args:
        mesh: what is cut.
        low: (3,) m, the box's least coordinates.
        high: (3,) m, its greatest.

    Raises:
        SurfaceError: bad numbers, or nothing is left.
    """
    least, most = checked_box(low, high)
    where = f"the box {_listed(least)} .. {_listed(most)}"
    result = mesh
    for direction in np.eye(3):
        for corner, inwards in ((least, direction), (most, -direction)):
            vertices, faces = _clipped(result, corner, inwards)
            if not len(faces):
                raise _nothing_left(mesh, f"nothing lies in {where}")
            if not np.array_equal(faces, result.faces):
                result = _part(result, vertices, faces, "", "")
    note = f"cut by {where}: {{faces}} faces, {{area:.4g}} of {{before:.4g}} m^2 kept"
    return _part(mesh, result.vertices, result.faces, "", note)


def faces_within_cone(
    mesh: TriangleMesh, direction: ArrayLike, half_angle_deg: float
) -> TriangleMesh:
    """Keep the faces whose outward normals lie within an angle of a direction, wherever they are.

    Args:
        mesh: what is taken from.
        direction: (3,) of any length; (0, 0, 1) for the faces that look up.
        half_angle_deg: degrees, above 0 and at most 180.

    Raises:
        SurfaceError: bad numbers, or no such face.
    """
    axis, angle = checked_cone(direction, half_angle_deg)
    # By both sine and cosine, which is exact near 0 and 180 degrees too.
    sine = np.linalg.norm(np.cross(mesh.face_normals, axis), axis=1)
    leaning = np.degrees(np.arctan2(sine, mesh.face_normals @ axis))
    chosen = leaning <= angle + 1e-9
    where = f"within {angle:g} degrees of {_listed(axis)}"
    note = f"faces {where}: {{faces}} faces, {{area:.4g}} of {{before:.4g}} m^2 kept"
    nothing = (
        f"no face looks {where}; the nearest leans away from it by {leaning.min():.4g} degrees"
    )
    return _part(mesh, mesh.vertices, mesh.faces[chosen], nothing, note)


def take_faces(mesh: TriangleMesh, indices: ArrayLike) -> TriangleMesh:
    """Keep the faces with these numbers, in the order of the mesh; repeated numbers count once.

    Args:
        mesh: what is taken from.
        indices: whole numbers from 0, or (F,) truth values.

    Raises:
        SurfaceError: numbers that name no face, or none at all.
    """
    try:
        numbers = np.array(indices)
    except ValueError as error:
        raise SurfaceError(f"indices of faces must be a list of whole numbers: {error}") from error
    count = len(mesh.faces)
    if numbers.dtype == bool and numbers.shape == (count,):
        numbers = np.flatnonzero(numbers)
    elif numbers.size == 0:
        numbers = np.empty(0, np.int64)
    elif numbers.ndim != 1 or numbers.dtype.kind not in "iu":
        raise SurfaceError(
            f"indices of faces must be a list of whole numbers, got {numbers.dtype} of shape "
            f"{numbers.shape}"
        )
    outside = (numbers < 0) | (numbers >= count)
    if outside.any():
        raise SurfaceError(
            f"{outside.sum()} of {len(numbers)} indices name no face, the first is "
            f"{numbers[outside.argmax()]}; the faces are 0 .. {count - 1}"
        )
    chosen = np.zeros(count, bool)
    chosen[numbers] = True
    note = "{faces} faces chosen by number, {area:.4g} of {before:.4g} m^2"
    return _part(mesh, mesh.vertices, mesh.faces[chosen], "no face was chosen", note)


def _part(
    mesh: TriangleMesh, vertices: Array, faces: Ints, nothing: str, note: str
) -> TriangleMesh:
    """A clean mesh of these faces, with a note after those of `mesh`."""
    if not len(faces):
        raise _nothing_left(mesh, nothing)
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    vertices, faces = vertices[used], (np.cumsum(used) - 1)[faces]
    vertices, faces, _ = one_fan_each(vertices, faces)
    part = TriangleMesh(vertices, faces, mesh.history)
    if not note:
        return part
    text = note.format(faces=len(faces), area=part.area, before=mesh.area)
    return TriangleMesh(vertices, faces, (*mesh.history, text))


def _nothing_left(mesh: TriangleMesh, nothing: str) -> SurfaceError:
    """The error that says where the mesh is."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return SurfaceError(f"{nothing}; the mesh lies in {_listed(low)} .. {_listed(high)} m")


def _clipped(mesh: TriangleMesh, point: Array, normal: Array) -> tuple[Array, Ints]:
    """The faces on one side of a plane, and those that it crosses, cut; new vertices come last.

    Faces that lie in the plane are kept. Both faces of an edge get the same new vertex.
    """
    heights = (mesh.vertices - point) @ normal
    heights[np.abs(heights) <= weld_distance(mesh.vertices)] = 0.0
    sides = np.sign(heights)[mesh.faces]
    above, below = (sides > 0).sum(axis=1), (sides < 0).sum(axis=1)

    def turned(chosen: Mask, first: Mask) -> Ints:
        """(3, n) corners of the chosen faces, from the one that is `first` on."""
        start = first[chosen].argmax(axis=1)[:, None]
        return np.take_along_axis(mesh.faces[chosen], (start + np.arange(3)) % 3, axis=1).T

    a1, b1, c1 = turned((above == 1) & (below == 2), sides > 0)
    a2, b2, c2 = turned((above == 2) & (below == 1), sides < 0)
    a3, b3, c3 = turned((above == 1) & (below == 1), sides == 0)
    crossings = ((a1, b1), (a1, c1), (a2, b2), (a2, c2), (b3, c3))
    ends = np.sort(np.concatenate([np.column_stack(pair) for pair in crossings]), axis=1)
    ends, number = np.unique(ends, axis=0, return_inverse=True)
    stops = np.cumsum([len(pair[0]) for pair in crossings])[:-1]
    ab1, ac1, ab2, ac2, bc3 = np.split(number.reshape(-1) + len(mesh.vertices), stops)
    share = heights[ends[:, 0]] / (heights[ends[:, 0]] - heights[ends[:, 1]])
    start, stop = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]]
    upward = heights[b3] > 0.0
    faces = [
        mesh.faces[below == 0],
        np.column_stack([a1, ab1, ac1]),
        np.column_stack([ab2, b2, c2]),
        np.column_stack([ab2, c2, ac2]),
        np.column_stack([a3, np.where(upward, b3, bc3), np.where(upward, bc3, c3)]),
    ]
    vertices = np.concatenate([mesh.vertices, start + share[:, None] * (stop - start)])
    return vertices, np.concatenate(faces)


def checked_plane(point: Any, normal: Any) -> tuple[Array, Array]:
    """The point (3,) m and the unit normal (3,) of a plane.

    Raises:
        SurfaceError: with everything that is wrong.
    """
    checks = Checks("cut by a plane")
    through = checks.vector("point", point, "metres")
    direction = unit_along(checks.direction("normal", normal))
    checks.done()
    return through, direction


def checked_box(low: Any, high: Any) -> tuple[Array, Array]:
    """The corners (3,) m of a box.

    Raises:
        SurfaceError: with everything that is wrong.
    """
    checks = Checks("cut by a box")
    least, most = checks.vector("low", low, "metres"), checks.vector("high", high, "metres")
    if not checks.faults and not (least < most).all():
        got = f"got {shown(low)} and {shown(high)}"
        below = "must be below the opposite corner in each coordinate"
        checks.keep(Fault("low", got, expected=below))
    checks.done()
    return least, most


def checked_cone(direction: Any, half_angle_deg: Any) -> tuple[Array, float]:
    """The unit axis (3,) and the half angle (degrees) of a cone.

    Raises:
        SurfaceError: with everything that is wrong.
    """
    checks = Checks("faces within a cone")
    axis = unit_along(checks.direction("direction", direction))
    expected = "must be a number > 0 and <= 180 (degrees)"
    angle = checks.number("half_angle_deg", half_angle_deg, expected, math.ulp(0.0), 180.0)
    checks.done()
    return axis, angle


def _listed(point: Array) -> str:
    """A point or direction for a message."""
    return "({:.4g}, {:.4g}, {:.4g})".format(*point)
