"""Curves between cells of meshes: on the surface within what they say, at rest over creases."""

import mesh_patches
import numpy as np
import pytest

from coverable import Task, mesh
from feasibility.targets.blocked import blocked_curves
from surfaces.meshes.triangle_mesh import TriangleMesh


def squares(size: float, seed: int, count: int = 674) -> TriangleMesh:
    """A flat sheet of squares that grew at random: full of notches, holes and narrow places."""
    rng = np.random.default_rng(seed)
    taken, front = set(), [(0, 0)]
    while len(taken) < count:
        i, j = front.pop(int(rng.integers(len(front))))
        if (i, j) not in taken:
            taken.add((i, j))
            front += [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
    vertices, faces = {}, []
    for i, j in sorted(taken):
        corners = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
        a, b, c, d = (vertices.setdefault(corner, len(vertices)) for corner in corners)
        faces += [[a, b, c], [a, c, d]]
    return TriangleMesh(np.array([[size * x, size * y, 0.0] for x, y in vertices]), faces)


def corner() -> TriangleMesh:
    u, v, faces = mesh_patches.grid(40, 40)
    i, j = np.divmod(np.arange(1600), 40)
    flat = np.column_stack([0.4 * u, 0.4 * v, 0.0 * u])
    own = faces[np.repeat((i < 9) | (j < 9), 2)]
    return TriangleMesh(*mesh_patches.used(mesh_patches.Mesh(flat, own)))


def plain(name):
    return lambda: TriangleMesh(*mesh_patches.PATCHES[name]())


# Meshes and how many cells; then by how much their curves say that they deviate at most, m.
SMOOTH = {name: (plain(name), 60, 0.05) for name in ("sheet", "dome", "hood")}
SMOOTH |= {
    "holed": (plain("holed"), 20, 0.01), "slivers": (plain("slivers"), 60, 0.05),
    "squares": (lambda: squares(0.02, 3), 20, 0.025), "corner": (corner, 20, 0.05),
}  # fmt: skip
ROUGH = {name: (plain(name), 60, np.inf) for name in ("blade", "scattered")}  # not all are usable


def off(cells, which, count=40):
    """At odd places of some curves: m from the surface, what normals are off, and what is said."""
    pair = np.repeat(which, count)
    t = np.random.default_rng(0).uniform(size=count)
    points, normals = cells.curves.at(pair, np.tile(t, len(which)))
    on = cells.surface.closest(points)
    turned = np.linalg.norm(normals - on.normal, axis=1)
    return np.abs(on.height), turned, *cells.curves.deviations[pair].T


@pytest.mark.parametrize("name", SMOOTH | ROUGH)
def test_curves_deviate_by_no_more_than_they_say(name):
    """Against the closest point of the surface; and begin and end at the centres of their cells.

    What is said is measured at even places, and half as much more: rarely it takes a little more.
    """
    make, count, share = (SMOOTH | ROUGH)[name]
    cells = mesh(make(), rpy_deg=(10, 20, 30)).cells(count)
    curves = cells.curves
    found = np.array(off(cells, np.arange(len(curves))))
    away, turned, said, bent = found[:, found[3] < 0.02]
    assert name in ROUGH or len(bent) == found.shape[1]
    assert len(bent) > 0.3 * found.shape[1]
    assert (away <= 1.3 * said + 1e-9).all()
    assert (away <= said + 1e-9).mean() > 0.999
    assert (turned <= 1.1 * bent + 1e-9).mean() > 0.999
    assert curves.deviations[:, 0].max() < share * cells.surface.mean_edge_length
    for end in (0, 1):
        points, normals = curves.at(np.arange(len(curves)), np.full(len(curves), float(end)))
        np.testing.assert_allclose(points, cells.centres[cells.pairs[:, end]], atol=1e-9)
        np.testing.assert_allclose(normals, cells.normals[cells.pairs[:, end]], atol=1e-9)


@pytest.mark.parametrize(("seed", "size", "count"), [(0, 0.019, 200), (10, 0.0231, 674)])
def test_an_exactly_flat_mesh_is_neither_creased_nor_rough(seed, size, count):
    cells = mesh(squares(size, seed), position=(0.5, 0, 0.2)).cells(count)
    assert blocked_curves(cells, Task(standoff=0.005, cone_deg=1)) == ""
