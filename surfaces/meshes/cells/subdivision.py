"""Split coarse triangles until they are small and even enough.

Triangles are halved at their longest edges, which makes no new needles (Rivara 1984). It would not
mend old ones either, so needles are cut across, like a ladder by its rungs. New vertices lie on
edges, and the surface stays exactly what it was.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from surfaces.meshes.cells.splits import SAME, Split, cut_across, edges_of, halve
from surfaces.meshes.triangle_mesh import doubled_areas
from surfaces.surface import SurfaceError

MOST_FACES = 4_000_000
LONGEST = 8.0  # edge^2 / most_area; 2.3 in an equilateral triangle, 4 in a halved square


@dataclass(frozen=True, eq=False, slots=True)
class Subdivision:
    """A finer mesh of the same surface, and where each part of it comes from."""

    vertices: NDArray[np.float64]
    """(W, 3) m; the first V are the old ones."""
    faces: NDArray[np.int64]
    """(G, 3) vertex indices, turning as before."""
    original: NDArray[np.int64]
    """(G,) the old face each one is a part of, in rising order."""
    ends: NDArray[np.int64]
    """(W - V, 2) the two vertices each new vertex lies between."""
    part: NDArray[np.float64]
    """(W - V,) how far it lies from the first to the second, 0 to 1."""
    stages: tuple[int, ...]
    """Number of vertices before each round and after the last; new ones use earlier rounds'."""

    def __post_init__(self) -> None:
        """Copy and write-protect the arrays."""
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                copy = value.copy()
                copy.flags.writeable = False
                object.__setattr__(self, field.name, copy)

    def spread(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values at the old vertices (V, ...) carried to all of them (W, ...).

        They are linear over each old face, so a field of normals keeps its shape. (The mean of the
        normals of the new faces would not: parts of a flat face are flat.)
        """
        old = self.stages[0]
        out = np.empty((len(self.vertices), *values.shape[1:]))
        out[:old] = values
        for begin, end in zip(self.stages[:-1], self.stages[1:], strict=True):
            ends, part = self.ends[begin - old : end - old], self.part[begin - old : end - old]
            first, second = out[ends[:, 0]], out[ends[:, 1]]
            part = part.reshape(-1, *(1,) * (values.ndim - 1))
            out[begin:end] = first + part * (second - first)
        return out


def subdivide(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], most_area: float
) -> Subdivision:
    """Split faces until each is at most `most_area`, and no edge is longer than sqrt(8 most_area).

    The result is conforming: no vertex lies inside another face's edge. It depends on nothing but
    the arguments.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) vertex indices of a clean mesh.
        most_area: m^2, > 0.

    Raises:
        SurfaceError: `most_area` is not a finite number > 0, or more than 4,000,000 faces would
            be needed.

    Example:
        >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
        >>> fine = subdivide(square, np.array([[0, 1, 2], [0, 2, 3]]), most_area=0.25)
        >>> fine.faces.tolist(), fine.original.tolist()
        ([[1, 2, 4], [1, 4, 0], [3, 0, 4], [3, 4, 2]], [0, 0, 1, 1])
    """
    if not (np.isfinite(most_area) and most_area > 0.0):
        raise SurfaceError(f"most_area must be a finite number > 0 (m^2), got {most_area!r}")
    vertices = np.asarray(vertices, dtype=float)
    faces = np.asarray(faces, dtype=np.int64)
    original = np.arange(len(faces), dtype=np.int64)
    stages, new = [len(vertices)], list[Split]()
    if _area(vertices, faces).sum() / most_area > MOST_FACES:
        raise _too_many()
    while (split := _next_split(vertices, faces, most_area)) is not None:
        if len(split.faces) > MOST_FACES:
            raise _too_many()
        start, end = vertices[split.ends[:, 0]], vertices[split.ends[:, 1]]
        vertices = np.concatenate([vertices, start + split.part[:, None] * (end - start)])
        faces, original = split.faces, original[split.parent]
        stages.append(len(vertices))
        new.append(split)
    ends = np.concatenate([np.empty((0, 2), dtype=np.int64), *(split.ends for split in new)])
    part = np.concatenate([np.empty(0), *(split.part for split in new)])
    return Subdivision(vertices, faces, original, ends, part, tuple(stages))


def _area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """(F,) m^2."""
    return np.linalg.norm(doubled_areas(vertices, faces), axis=1) / 2.0


def _next_split(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], most_area: float
) -> Split | None:
    """One round of splits, or None where nothing is too large.

    First faces are halved until each has a short edge, then long ones are cut across from there,
    and at last those that are still too large are halved.
    """
    edges = edges_of(vertices, faces)
    most = most_area * (1.0 + SAME)
    count = np.ceil(edges.length / math.sqrt(LONGEST * most)).astype(np.int64).clip(1)
    wide: NDArray[np.bool_] = np.all(count[edges.of_face] > 1, axis=1)
    if wide.any():
        return halve(faces, edges, wide, len(vertices))
    if (count > 1).any():
        if count[edges.of_face].sum() - 2 * len(faces) > MOST_FACES:
            raise _too_many()
        return cut_across(vertices, faces, edges, count)
    large: NDArray[np.bool_] = _area(vertices, faces) > most
    return halve(faces, edges, large, len(vertices)) if large.any() else None


def _too_many() -> SurfaceError:
    """Raised instead of filling the memory."""
    return SurfaceError(
        f"cells this small need more than {MOST_FACES:,} triangles; ask for larger cells, or "
        "mesh the part again with triangles of even size instead of long needles"
    )
