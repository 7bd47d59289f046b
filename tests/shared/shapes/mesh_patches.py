"""Test meshes as plain vertices and faces: grids bent into shapes, and grids made irregular."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable import MeshSurface, Patch
from coverable import mesh as surface_of
from surfaces.meshes.cells.mesh_cells import MeshCells
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.patches.grid_cells import GridCells

Floats = NDArray[np.float64]


class Mesh(NamedTuple):
    vertices: Floats
    """(V, 3) m."""
    faces: NDArray[np.int64]
    """(F, 3) counter-clockwise seen from outside."""


def grid(nu: int, nv: int) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """A unit square cut into nu x nv rectangles of two triangles: u, v of the vertices, faces."""
    u, v = np.meshgrid(np.linspace(0, 1, nu + 1), np.linspace(0, 1, nv + 1), indexing="ij")
    i, j = np.meshgrid(np.arange(nu), np.arange(nv), indexing="ij")
    a = (i * (nv + 1) + j).ravel()
    b, c, d = a + nv + 1, a + nv + 2, a + 1
    faces = np.stack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)], axis=1)
    return u.ravel(), v.ravel(), faces.reshape(-1, 3)


def bent(shape: Callable[[Floats, Floats], tuple[Floats, ...]], nu: int, nv: int) -> Mesh:
    """A grid bent by (u, v) -> (x, y, z), u and v in 0..1."""
    u, v, faces = grid(nu, nv)
    return Mesh(np.stack(np.broadcast_arrays(*shape(u, v)), axis=1), faces)


def of_patch(patch: Patch, nu: int, nv: int) -> Mesh:
    """Triangles with vertices on a patch at even parameters, looking where its normals do."""
    u, v = np.meshgrid(
        np.linspace(*patch.u_range, nu + 1), np.linspace(*patch.v_range, nv + 1), indexing="ij"
    )
    _, _, faces = grid(nu, nv)
    points, normals = (at(u, v).reshape(-1, 3) for at in (patch.point, patch.normal))
    a, b, c = points[faces].swapaxes(0, 1)
    outwards = (np.cross(b - a, c - a) * normals[faces[:, 0]]).sum() > 0.0
    return Mesh(points, faces if outwards else faces[:, ::-1])


def in_cells_of(cells: GridCells, parts: int) -> MeshCells:
    """The patch of some cells as triangles, `parts` x `parts` rectangles of two in each cell."""
    patch, (nu, nv) = cells.surface, (parts * count for count in cells.shape)
    i, j = np.indices((nu, nv)) // parts
    label = (i * cells.shape[1] + j).ravel()
    surface = surface_of(TriangleMesh(*of_patch(patch, nu, nv)), side=patch.side)
    return MeshCells.of(surface, np.repeat(label, 2))


def sheet(n: int = 40) -> Mesh:
    return bent(lambda u, v: (0.6 * u, 0.4 * v, 0.0 * u), n, n)


def dome(nu: int = 40, nv: int = 50) -> Mesh:
    """Part of a sphere, with small triangles near its pole."""

    def shape(u, v):
        polar, azimuth = np.radians(10 + 80 * u), np.radians(10 + 170 * v)
        s = np.sin(polar)
        return s * np.cos(azimuth), s * np.sin(azimuth), np.cos(polar)

    return bent(shape, nu, nv)


def hood(nu: int = 60, nv: int = 50) -> Mesh:
    """A car-hood-like patch: crowned, with a rib and waves."""

    def shape(u, v):
        x, y = 1.2 * u - 0.6, 1.4 * v - 0.7
        rib = 0.05 * np.exp(-((x / 0.12) ** 2))
        wave = 0.015 * np.sin(9.0 * x) * np.cos(7.0 * y)
        return x, y, 0.25 - 0.2 * x**2 - 0.15 * y**2 + rib + wave

    return bent(shape, nu, nv)


def blade(nu: int = 80, nv: int = 40) -> Mesh:
    """A turbine-blade-like patch: a thin closed profile, less its trailing edge, twisted."""

    def shape(u, v):
        angle = 0.25 + (2.0 * np.pi - 0.5) * u
        chord = 0.2 * (1.0 - 0.3 * v)
        x, y = chord * np.cos(angle), 0.15 * chord * np.sin(angle) * (1.0 - 0.7 * np.cos(angle))
        y = y - 0.3 * chord * np.cos(angle) ** 2
        c, s = np.cos(0.8 * v), np.sin(0.8 * v)
        return x * c - y * s, x * s + y * c, 0.6 * v

    return bent(shape, nu, nv)


SIDES = (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)


def box(x: float = 0.8, y: float = 0.5, z: float = 0.3) -> Mesh:
    """A closed box of twelve triangles, two of each of its `SIDES`, with a corner at the origin."""
    corners = np.array([[i * x, j * y, k * z] for i, j, k in np.ndindex(2, 2, 2)], dtype=float)
    return Mesh(corners, np.array([f for a, b, c, d in SIDES for f in ((a, b, c), (a, c, d))]))


def holed(n: int = 60) -> Mesh:
    """A square sheet with a large round hole and a slot."""
    mesh = sheet(n)
    x, y = (mesh.vertices[mesh.faces].mean(axis=1)[:, :2] / [0.6, 0.4]).T
    hole = (x - 0.35) ** 2 + (y - 0.5) ** 2 < 0.2**2
    slot = (abs(x - 0.8) < 0.04) & (abs(y - 0.5) < 0.35)
    return used(Mesh(mesh.vertices, mesh.faces[~hole & ~slot]))


def slivers() -> Mesh:
    """A cylinder as CAD programs export it: strips of two triangles, 40 times longer than wide."""
    return bent(lambda u, v: (0.2 * np.cos(6 * u), 0.2 * np.sin(6 * u), 0.9 * v), 50, 1)


def wedge() -> Mesh:
    """One triangle, 50 times longer than wide: all cells lie in a row."""
    corners = np.array([[0.0, -0.01, 0.0], [1.0, 0.0, 0.0], [0.0, 0.01, 0.0]])
    return Mesh(corners, np.array([[0, 1, 2]], dtype=np.int64))


def scattered(count: int = 3000, seed: int = 5) -> Mesh:
    """A wavy patch over random points, dense in one corner: triangles of all shapes and sizes."""
    rng = np.random.default_rng(seed)
    inner = rng.uniform(0, 1, (count, 2)) ** [1.8, 1.2]
    t = np.linspace(0, 1, 30)
    sides = [np.column_stack(p) for p in ((t, 0 * t), (t, 0 * t + 1), (0 * t, t), (0 * t + 1, t))]
    points = np.unique(np.concatenate([inner, *sides]), axis=0)
    x, y = points.T
    wavy = np.column_stack([x, 0.8 * y, 0.1 * np.sin(5 * x) * np.cos(4 * y)])
    return used(Mesh(wavy, flat_faces(points, 1e-9)))


def flat_faces(points: Floats, least: float) -> NDArray[np.int64]:
    """Triangles of points (k, 2), counter-clockwise, each of more than half the `least` area."""
    from scipy.spatial import Delaunay

    faces = Delaunay(points).simplices.astype(np.int64)
    (ax, ay), (bx, by), (cx, cy) = points[faces].transpose(1, 2, 0)
    turn = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    faces[turn < 0] = faces[turn < 0][:, ::-1]
    return faces[abs(turn) > least]


def stacked(*parts: tuple[Floats, NDArray[np.int64]]) -> Mesh:
    """Several in one, beside each other as they are."""
    starts = np.cumsum([0] + [len(v) for v, _ in parts])
    faces = [f + k for (_, f), k in zip(parts, starts, strict=False)]
    return Mesh(np.concatenate([v for v, _ in parts]), np.concatenate(faces))


def islands() -> Mesh:
    """Three separate sheets of different sizes."""
    parts = [sheet(20), hood(24, 20), sheet(8)]
    scale, shift = (1.0, 1.0, 0.3), ([0, 0, 0], [2.0, 0, 0], [0, 2.0, 0])
    placed = zip(parts, scale, shift, strict=True)
    return stacked(*((s * m.vertices + t, m.faces) for m, s, t in placed))


def used(mesh: Mesh) -> Mesh:
    kept, inverse = np.unique(mesh.faces.ravel(), return_inverse=True)
    return Mesh(mesh.vertices[kept], inverse.reshape(-1, 3).astype(np.int64))


CONNECTED: dict[str, Callable[[], Mesh]] = {
    each.__name__: each
    for each in (sheet, dome, hood, blade, box, holed, slivers, scattered, wedge)
}
"""Each in one piece."""

PATCHES: dict[str, Callable[[], Mesh]] = {**CONNECTED, "islands": islands}


def folded_sheet(radius: float, facets: int) -> Mesh:
    """A sheet that bends down at a right angle over a rounded edge, 300 mm wide."""
    t = np.linspace(0.0, np.pi / 2, facets + 1)
    bend = 0.3 + radius * np.column_stack([np.sin(t) - 1, np.cos(t) - 1])
    flat = [(y, 0.3) for y in np.linspace(0.0, 0.3 - radius, 7)[:-1]]
    flange = [(0.3, z) for z in np.linspace(0.3 - radius, 0.24, 3)[1:]]
    profile = np.array([*flat, *bend, *flange])
    u, v, faces = grid(8, len(profile) - 1)
    place = np.round(v * (len(profile) - 1)).astype(np.int64)
    return Mesh(np.column_stack([0.3 * u, profile[place]]), faces)


def panel_with_hole(edge: float = 0.01) -> MeshSurface:
    """0.6 x 0.4 m with a hole of 80 mm radius in its middle, as irregular triangles."""
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(0.0, 0.6 + edge / 2, edge), np.arange(0.0, 0.4 + edge / 2, edge))
    points = np.column_stack([x.ravel(), y.ravel()])
    inner = ((points > 1e-9) & (points < [0.6 - 1e-9, 0.4 - 1e-9])).all(axis=1)
    points[inner] += rng.uniform(-0.2, 0.2, (int(inner.sum()), 2)) * edge
    off = np.linalg.norm(points - [0.3, 0.2], axis=1)
    angle = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    rim = np.array([0.3, 0.2]) + 0.08 * np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.concatenate([points[off > 0.08 + 0.4 * edge], rim])
    faces = flat_faces(points, 0.0)
    middle = points[faces].mean(axis=1)
    faces = faces[np.linalg.norm(middle - [0.3, 0.2], axis=1) > 0.0799]
    return surface_of(TriangleMesh(np.column_stack([points, np.zeros(len(points))]), faces))


def roof(angle_deg: float, side: float = 0.3) -> TriangleMesh:
    """Two plates that meet at an edge along y; the normal turns by the angle there."""
    half = np.radians(angle_deg) / 2
    x, z = side * np.cos(half), -side * np.sin(half)
    vertices = [[0, 0, 0], [0, side, 0], [x, 0, z], [x, side, z], [-x, 0, z], [-x, side, z]]
    return TriangleMesh(np.array(vertices), [[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4]])


def can() -> TriangleMesh:
    turn = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    circle = 0.15 * np.column_stack([np.cos(turn), np.sin(turn)])
    low, high = (np.column_stack([circle, np.full(48, z)]) for z in (-0.1, 0.1))
    k, after = np.arange(48), (np.arange(48) + 1) % 48
    wall = [np.column_stack([k, after, 48 + k]), np.column_stack([after, 48 + after, 48 + k])]
    lid = np.column_stack([48 + k, 48 + after, np.full(48, 96)])
    return TriangleMesh(np.vstack([low, high, [[0, 0, 0.1]]]), np.vstack([*wall, lid]))
