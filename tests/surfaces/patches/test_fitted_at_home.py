"""Curves that are fitted once for all poses, against such fitted at each."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from surfaces import bspline, cone, cylinder, ellipsoid, plane, sphere, torus
from surfaces.curve_fitting import CurveFit
from surfaces.patches import GridCells, Patch

NET = np.array([[[x, y, 0.2 * np.sin(3 * x + y)] for y in range(4)] for x in range(5)]) / 5.0
PATCHES = {
    "sphere": (sphere(1.0, (10, 90), (10, 180)), (5, 6)),
    "dome over its pole": (sphere(1.0, (0, 60), (-180, 180)), (4, 6)),
    "pipe": (cylinder(0.3, (-180, 180), (0.0, 0.5)), (6, 3)),
    "plane": (plane((0, 0.5), (0, 0.3)), (3, 4)),
    "cone": (cone(0.5, 0.4, (0, 90), (0.1, 0.3)), (3, 3)),
    "torus": (torus(0.5, 0.1, (0, 90), (0, 120)), (4, 4)),
    "ellipsoid": (ellipsoid([0.5, 0.4, 0.3], (30, 90), (0, 90)), (4, 4)),
    "spline": (bspline(NET), (4, 5)),
}


def posed(surface: Patch, rng: np.random.Generator) -> Patch:
    """The same surface anywhere."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return surface.moved(turn * np.sign(np.linalg.det(turn)), rng.normal(size=3))


@pytest.mark.parametrize("name", PATCHES)
def test_moved_curves_are_those_fitted_in_place(name: str) -> None:
    rng = np.random.default_rng(5)
    surface, shape = PATCHES[name]
    for _ in range(2):
        cells = GridCells.cut(posed(surface, rng), *shape)
        moved, fitted = cells.curves, CurveFit.of(cells).joined()
        np.testing.assert_array_equal(moved.first, fitted.first)
        np.testing.assert_allclose(moved.cubics, fitted.cubics, rtol=0, atol=1e-10)
        for item in ("derivative_bounds", "deviations"):
            ours, theirs = getattr(moved, item), getattr(fitted, item)
            np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-9)
        start, _ = moved.at(np.arange(len(moved)), np.zeros(len(moved)))
        np.testing.assert_allclose(start, cells.centres[cells.pairs[:, 0]], rtol=0, atol=1e-14)


def test_curves_do_not_depend_on_what_was_asked_before() -> None:
    """Two patches that differ in anything have curves of their own; order and side do not count."""
    rng = np.random.default_rng(7)
    one, other = sphere(1.0, (10, 90), (10, 180)), sphere(1.1, (10, 90), (10, 180))
    there = posed(one, rng)
    first = GridCells.cut(there, 3, 4).curves
    assert not np.allclose(
        GridCells.cut(other, 3, 4).curves.cubics, GridCells.cut(one, 3, 4).curves.cubics
    )
    assert len(GridCells.cut(there, 4, 3).curves) != 0
    for _ in range(6):  # more than are kept
        _ = GridCells.cut(sphere(rng.uniform(0.5, 2.0), (10, 90), (10, 180)), 3, 4).curves
    again = GridCells.cut(replace(there, side="outside"), 3, 4).curves
    for item in fields(first):
        np.testing.assert_array_equal(getattr(first, item.name), getattr(again, item.name))


def test_cells_that_are_not_evenly_spaced_keep_their_places() -> None:
    rng = np.random.default_rng(9)
    surface = posed(PATCHES["sphere"][0], rng)
    even = GridCells.cut(surface, 3, 4)
    u = even.u + rng.uniform(-0.05, 0.05, len(even))
    cells = replace(even, u=u, centres=surface.point(u, even.v), normals=surface.normal(u, even.v))
    start, _ = cells.curves.at(np.arange(len(cells.pairs)), np.zeros(len(cells.pairs)))
    np.testing.assert_allclose(start, cells.centres[cells.pairs[:, 0]], rtol=0, atol=1e-14)
