"""A surface as an obstacle: triangles, and how far the surface may be from them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from coverable.arrays import Array, Protected
from coverable.errors import LARGEST, Checks
from surfaces.at_home import AtHome
from surfaces.meshes.mesh_surface import MeshSurface
from surfaces.patches.patch import Patch
from surfaces.piecewise.piecewise_surface import Piecewise
from surfaces.surface import Surface, SurfaceError
from surfaces.tiles import FlatTiles, flat_tiles

DEVIATION = 2e-4  # [m]
MOST_TRIANGLES = 32_768
MOST_LAYERS = 64
COARSER = 1.2  # by which the deviation grows where there would be too many triangles
KEPT = 8  # surfaces whose triangles are remembered: one that is moved has the same


@dataclass(frozen=True, eq=False, slots=True)
class Sheet(Protected):
    """A two-sided sheet of triangles in the root frame.

    It covers all of the surface, margins outside the outermost cell centres included. Triangles of
    a smooth surface may leave gaps at their edges: only distances count, and what stays further
    than `deviation` from all of them does not touch the surface.
    """

    own: Array
    """(k, 3, 3) m, the corners of each triangle in the surface's own frame, the same at any
    pose."""
    rotation: Array
    """(3, 3) of that frame in the root frame."""
    position: Array
    """(3,) m"""
    deviation: float
    """m, no point of the surface is further than this from a triangle."""

    @property
    def triangles(self) -> Array:
        """(k, 3, 3) m, the corners of each triangle."""
        return np.asarray(self.own @ self.rotation.T + self.position)


def sheet_of(
    surface: Surface,
    deviation: float = DEVIATION,
    most: int = MOST_TRIANGLES,
    thickness: float = 0.0,
) -> Sheet:
    """The surface as triangles, with a certified deviation.

    A mesh gives its own triangles. Any other surface is cut into tiles, on each of which
    |f - (c + x_1 e_1 + x_2 e_2 + x_1 x_2 t)| <= r_f for |x_i| <= 1 (see `FlatTiles`). With t along
    one of the slopes and no longer, that is a flat convex quadrilateral: its two triangles are
    taken, and the deviation is the largest r_f. Nothing is sampled.

    With a thickness T the sheet is the slab of all points f + t b, 0 <= t <= T, with b the unit
    normal away from the working side; of a mesh, the normals of its faces, so each face carries a
    prism. It becomes layers at equal steps s = T / m of t. Of the place at t the nearest layer has
    one at most s / 2 away, and with the model of the normal, |n - ...| <= r_n, the layer is within
    r_f + T r_n of its parallelograms. So the inside of the slab is near a triangle too: no side
    walls are needed, and a slab that folds over itself is held as well.

    Args:
        surface: any kind.
        deviation: m > 0, the largest deviation wanted.
        most: about how many triangles may be made of a smooth surface, or of the layers of any;
            beyond, they are coarser and their deviation, as stated, is larger.
        thickness: m >= 0, of the sheet, away from the working side.

    Raises:
        ArgumentError: a number is not what it must be.
        SurfaceError: no bounds on the surface are known, so that nothing can be certified.

    Example:
        >>> from coverable import plane
        >>> sheet = sheet_of(plane((0.0, 0.6), (0.0, 0.4)))
        >>> sheet.triangles.shape, sheet.deviation < 1e-9
        ((2, 3, 3), True)
    """
    checks = Checks("a sheet")
    wanted = checks.positive("deviation", deviation)
    checks.whole("most", most, 2)
    depth = checks.number("thickness", thickness, "must be a finite number >= 0 (metres)", 0.0)
    checks.done()
    steps = min(math.ceil(depth / (2.0 * wanted)), MOST_LAYERS)
    if isinstance(surface, MeshSurface):
        steps = min(steps, max(1, most // len(surface.mesh.faces) - 1)) if depth else 0
        triangles, normals, off = _of_mesh(surface)
    else:
        triangles, normals, off = _of_tiles(AtHome(surface), wanted, depth, most // (steps + 1))
    away = -surface.side_sign * normals
    layers = [triangles + t * away for t in np.linspace(0.0, depth, steps + 1)]
    between = depth / (2.0 * steps) if steps else 0.0
    return Sheet(np.concatenate(layers), surface.rotation, surface.position, off + between)


def _of_mesh(surface: MeshSurface) -> tuple[Array, Array, float]:
    """The triangles of a mesh, their outward normals at each corner, and no deviation."""
    mesh = surface.mesh
    normals = np.repeat(mesh.face_normals[:, None], 3, axis=1)
    return mesh.vertices[mesh.faces], normals, 0.0


@lru_cache(maxsize=KEPT)
def _of_tiles(
    home: AtHome, deviation: float, depth: float, most: int
) -> tuple[Array, Array, float]:
    """Triangles of a smooth surface, normals at their corners by the models, and r_f + T r_n."""
    found = tiles_of(home.surface, deviation, depth, most // 2)
    if found is None:
        raise SurfaceError(
            "no bounds are known on this surface, so nothing can be certified to stay clear of "
            "it; leave collisions with it out",
            home.surface.kind,
        )
    halves = found.halves()
    return halves[..., :3], halves[..., 3:], float(found.deviations(depth).max())


def tiles_of(surface: Surface, deviation: float, depth: float, most: int) -> FlatTiles | None:
    """Tiles of a patch, or of several; coarser where there would be more than `most`.

    None where no bounds are known on the surface.
    """
    pieces = [(surface, 1.0)] if isinstance(surface, Patch) else []
    if isinstance(surface, Piecewise):
        pieces = list(zip(surface.placed, surface.signs, strict=True))
    while pieces and deviation <= LARGEST:
        found = flat_tiles(pieces, deviation, depth, most)
        if found is not None:
            return found
        deviation *= COARSER
    return None
