"""Curves past notches and holes of flat meshes: they stay on the surface."""

from __future__ import annotations

from collections.abc import Callable

import mesh_patches
import numpy as np
import pytest

from feasibility import Task
from feasibility.targets import blocked_curves
from surfaces.meshes import TriangleMesh, mesh

FLAT = Task(standoff=0.005, cone_deg=1)


def squares(count: int, size: float, seed: int) -> TriangleMesh:
    """A flat sheet of squares that grew at random: full of notches, holes and narrow places."""
    rng = np.random.default_rng(seed)
    taken: set[tuple[int, int]] = set()
    front = [(0, 0)]
    while len(taken) < count:
        i, j = front.pop(int(rng.integers(len(front))))
        if (i, j) not in taken:
            taken.add((i, j))
            front += [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
    vertices: dict[tuple[int, int], int] = {}
    faces = []
    for i, j in sorted(taken):
        corners = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
        a, b, c, d = (vertices.setdefault(corner, len(vertices)) for corner in corners)
        faces += [[a, b, c], [a, c, d]]
    places = np.array([[size * x, size * y, 0.0] for x, y in vertices])
    return TriangleMesh(places, faces)


@pytest.mark.parametrize(("seed", "size", "count"), [(0, 0.019, 200), (10, 0.0231, 674)])
def test_an_exactly_flat_mesh_is_neither_creased_nor_rough(
    seed: int, size: float, count: int
) -> None:
    cells = mesh(squares(674, size, seed), position=(0.5, 0, 0.2)).cells(count)
    assert blocked_curves(cells, FLAT) == ""


@pytest.mark.parametrize("name", ["squares", "holed", "corner"])
def test_curves_along_a_border_deviate_by_no_more_than_they_say(name: str) -> None:
    """Against the closest point of all of the surface, anywhere on the curve."""
    sheets = {
        "squares": lambda: squares(674, 0.02, 3),
        "holed": lambda: TriangleMesh(*mesh_patches.holed()),
        "corner": lambda: mesh_of(lambda i, j: i < 9 or j < 9, 40),
    }
    cells = mesh(sheets[name](), rpy_deg=(10, 20, 30)).cells(20)
    curves = cells.curves
    t = np.random.default_rng(0).uniform(size=200)
    pair = np.repeat(np.arange(len(curves)), len(t))
    point, normal = curves.at(pair, np.tile(t, len(curves)))
    on = cells.surface.closest(point)
    assert (np.abs(on.height) <= curves.deviations[pair, 0] + 1e-9).all()
    assert (np.linalg.norm(normal - on.normal, axis=1) <= curves.deviations[pair, 1] + 1e-9).all()
    assert curves.deviations[:, 0].max() < 5e-4


def mesh_of(inside: Callable[[int, int], bool], n: int) -> TriangleMesh:
    """The squares (i, j) of an n x n grid that are inside."""
    u, v, faces = mesh_patches.grid(n, n)
    rows, columns = np.divmod(np.arange(n * n), n)
    kept = np.repeat([bool(inside(i, j)) for i, j in zip(rows, columns, strict=True)], 2)
    flat = np.column_stack([0.4 * u, 0.4 * v, 0.0 * u])
    return TriangleMesh(*mesh_patches.used(mesh_patches.Mesh(flat, faces[kept])))
