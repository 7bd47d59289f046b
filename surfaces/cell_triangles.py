"""Cells of any surface as triangles, for compiled loops; see `surfaces.triangle_kernel`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from surfaces.cells import Cells
from surfaces.meshes.cells.mesh_cells import MeshCells
from surfaces.meshes.face_tree import FaceTree
from surfaces.patches.grid_cells import GridCells
from surfaces.piecewise.piece_cells import PieceCells
from surfaces.sheet import tiles_of
from surfaces.surface import SurfaceError, max_principal_curvature
from surfaces.tiles import CORNERS, FlatTiles
from surfaces.triangle_kernel import TriangleKernel

SHARE = 0.01  # [1] of the tolerance: how far triangles may be off, if so many will do
MOST_TILES = 16_384
REACH = 4.0  # [1] of e: how far a place may be beyond its tile; places differ by 2 e at an edge


class Triangulation(NamedTuple):
    """Cells as triangles, with what is known of them."""

    kernel: TriangleKernel
    off: Array
    """(N,) m, how far the height may be from that over the parallel surface f + h n: e + s d of
    the kernel's text; on a mesh, whose normals lean from its faces by a chord c, h c^2 / 2."""
    turn: float
    """How far the unit normals may be off."""
    curvature: Array
    """(N,) 1/m, the largest of the surface and of its parallel, on each cell or more of them."""
    edge: float
    """m, mean length of a mesh's edges; 0 for smooth surfaces."""
    swerve: float = 0.0
    """How far the unit u directions may be off, by what is seen in the middle of each triangle."""


def triangulation(
    cells: Cells, height: float, tolerance: float, tangents: bool = False
) -> Triangulation:
    """Triangles for points that are about `height` (m) over the surface of some cells.

    Args:
        cells: of a mesh, of a patch or of several patches.
        height: m, signed, along the outward normal.
        tolerance: m > 0, by how much the heights of points may differ from that.
        tangents: whether `u_direction_under` will be asked for; a mesh has none.

    Raises:
        SurfaceError: no bounds are known on the surface.
    """
    if isinstance(cells, MeshCells):
        return _of_mesh(cells, height)
    grids = [cells] if isinstance(cells, GridCells) else []
    if isinstance(cells, PieceCells):
        grids = list(cells.grids)
    depth = abs(height) + tolerance
    found = tiles_of(cells.surface, SHARE * tolerance, depth, MOST_TILES) if grids else None
    if found is None:
        raise SurfaceError(
            "the greedy search needs bounds on the surface, and none are known on this one; use "
            'search.method = "complete"',
            cells.surface.kind,
        )
    made = _of_tiles(cells, grids, found, height, tolerance)
    return _with_tangents(made, grids) if tangents else made


def _with_tangents(made: Triangulation, grids: list[GridCells]) -> Triangulation:
    """The same, with u directions at the corners."""
    kernel = made.kernel
    directions, middles = np.empty_like(kernel.normals), np.empty_like(kernel.normals[:, 0])
    for k, grid in enumerate(grids):
        rows = kernel.piece == k
        u, v = np.moveaxis(kernel.parameters[rows], 2, 0)
        directions[rows] = grid.surface.tangent(u, v)
        middles[rows] = grid.surface.tangent(u.mean(axis=1), v.mean(axis=1))
    mean = directions.mean(axis=1)
    length = np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)
    off = np.linalg.norm(mean / length - middles, axis=1)
    return made._replace(
        kernel=kernel._replace(tangents=directions), swerve=float(off.max(initial=0.0))
    )


def _of_mesh(cells: MeshCells, height: float) -> Triangulation:
    """The mesh's own triangles."""
    surface, row = cells.surface, cells.surface.face_tree.order
    kernel = TriangleKernel(
        tree=surface.face_tree,
        rotation=np.array(surface.rotation),
        position=np.array(surface.position),
        normals=surface.corner_normals[row],
        crease_normals=surface.crease_normals[row],
        on_crease=surface.on_crease[row],
        on_border=np.stack(surface.on_border, axis=1)[row],
        cell=cells.labels[row],
        piece=np.zeros(len(row), dtype=np.int64),
        parameters=np.zeros((len(row), 3, 2)),
        tangents=np.empty((0, 3, 3)),
        ranges=np.zeros((1, 2, 2)),
        closed=np.zeros((1, 2), dtype=np.bool_),
        counts=np.zeros((1, 3), dtype=np.int64),
        total=len(cells),
        deviation=0.0,
        reach=0.0,
        gap=0.0,
        last=np.zeros(1, dtype=np.int64),
        weights=np.zeros(3),
    )
    leans = surface.crease_normals - surface.mesh.face_normals[:, None]
    off = np.zeros(len(cells))
    lean = np.einsum("fci,fci->fc", leans, leans).max(axis=1)
    np.maximum.at(off, cells.labels, 0.5 * abs(height) * lean)
    curvature = np.maximum(cells.parallel_curvature(height), cells.max_curvature)
    return Triangulation(kernel, off, 0.0, curvature, surface.mean_edge_length)


def _of_tiles(
    cells: Cells, grids: list[GridCells], found: FlatTiles, height: float, tolerance: float
) -> Triangulation:
    """Two triangles for each tile."""
    halves, parameters = found.halves(), found.parameters()
    tree = FaceTree.of(np.ascontiguousarray(halves[..., :3]))
    row = tree.order
    normals = np.ascontiguousarray(halves[row, :, 3:])
    ends = np.array([(grid.surface.u_range, grid.surface.v_range) for grid in grids])
    shapes = np.array([grid.shape for grid in grids], dtype=np.int64)
    sizes = shapes.prod(axis=1)
    within = float(found.deviations(abs(height) + tolerance).max())
    gap = float(getattr(cells.surface, "gap", 0.0))
    reach = REACH * within + gap
    steps, turns = found.models.slopes[..., :3], found.models.slopes[..., 3:]
    bent, lean = np.zeros(len(grids)), 0.0
    for h in (0.0, height - tolerance, height + tolerance):
        np.maximum.at(bent, found.piece, max_principal_curvature(steps + h * turns, turns))
        lean = max(lean, _lean(found, h))
    lean += float(found.models.radius[:, 1].max()) + float(bent.max()) * (within + reach)
    deviation = within + lean * reach
    kernel = TriangleKernel(
        tree=tree,
        rotation=np.eye(3),
        position=np.zeros(3),
        normals=normals,
        crease_normals=normals,
        on_crease=np.zeros((len(row), 3), dtype=np.bool_),
        on_border=np.zeros((len(row), 2, 3), dtype=np.bool_),
        cell=np.full(len(row), -1),
        piece=np.repeat(found.piece, 2)[row],
        parameters=np.ascontiguousarray(parameters[row]),
        tangents=np.empty((0, 3, 3)),
        ranges=np.stack([ends[..., 0], ends[..., 1] - ends[..., 0]], axis=1),
        closed=np.array([(grid.surface.u_closed, grid.surface.v_closed) for grid in grids]),
        counts=np.column_stack([shapes, np.cumsum(sizes) - sizes]),
        total=len(cells),
        deviation=deviation,
        reach=reach,
        gap=gap,
        last=np.zeros(1, dtype=np.int64),
        weights=np.zeros(3),
    )
    turn = 2.0 * float(found.models.radius[:, 1].max()) + float(bent.max()) * deviation
    off = np.full(len(cells), deviation)
    return Triangulation(kernel, off, turn, np.repeat(bent, sizes), 0.0)


def _lean(found: FlatTiles, height: float) -> float:
    """How far normals of tiles lean at most into the tangents of their parallel at a height (m)."""
    slopes, turns = found.models.slopes[..., :3], found.models.slopes[..., 3:]
    across = np.cross(*np.moveaxis(slopes + height * turns, 1, 0))
    size = np.linalg.norm(across, axis=1, keepdims=True)
    across = across / np.where(size > 0.0, size, 1.0)
    normals = found.models.centre[:, None, 3:] + CORNERS @ turns
    inside = normals - (normals @ across[..., None]) * across[:, None]
    return float(np.linalg.norm(inside, axis=-1).max(initial=0.0))
