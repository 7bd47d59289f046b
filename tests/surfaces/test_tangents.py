"""The u directions at the centres of cells."""

import numpy as np
import random_surfaces

from surfaces import Patch, bspline, piecewise, plane, sphere
from surfaces.meshes import MeshSurface


def test_of_a_sphere_they_are_the_meridians():
    cells = sphere(0.7, (0, 180), (0, 360), position=(1, 2, 3), rpy_deg=(20, 30, 40)).cells(5, 6)
    u, v = cells.u, cells.v
    local = np.stack([np.cos(u) * np.cos(v), np.cos(u) * np.sin(v), -np.sin(u)], axis=1)
    np.testing.assert_allclose(cells.tangents, local @ cells.surface.rotation.T, atol=1e-9)


def test_of_every_patch_they_are_unit_tangents_along_which_u_grows():
    rng = np.random.default_rng(7)
    for kind in random_surfaces.KINDS:
        surface = random_surfaces.random_surface(kind, rng)
        if not isinstance(surface, Patch):
            continue
        cells = surface.cells(3, 4)
        found = cells.tangents
        np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-12)
        np.testing.assert_allclose((found * cells.normals).sum(axis=1), 0.0, atol=1e-12)
        step = 1e-6 * (surface.u_range[1] - surface.u_range[0])
        moved = surface.point(cells.u + step, cells.v) - cells.centres
        moved /= np.linalg.norm(moved, axis=1, keepdims=True)
        assert np.linalg.norm(moved - found, axis=1).max() < 1e-3


def test_of_a_spline_they_are_its_derivatives():
    rng = np.random.default_rng(3)
    net = np.stack(
        [*np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij"), rng.random((5, 6))], 2
    )
    patch = bspline(net)
    cells = patch.cells(4, 4)
    along_u, _ = patch.net.tangents(np.stack([cells.u, cells.v], axis=1))
    exact = along_u / np.linalg.norm(along_u, axis=1, keepdims=True)
    np.testing.assert_allclose(cells.tangents, exact, atol=1e-8)


def test_of_joined_pieces_they_are_those_of_each_piece_and_of_a_mesh_there_are_none():
    pieces = [plane((0, 1), (0, 1)), plane((1, 2), (0, 1))]
    joined = piecewise(pieces, rpy_deg=(0, 0, 90)).cells((2, 3))
    np.testing.assert_allclose(joined.tangents, np.tile([0.0, 1.0, 0.0], (12, 1)), atol=1e-9)
    mesh = random_surfaces.random_surface("mesh", np.random.default_rng(0))
    assert isinstance(mesh, MeshSurface)
    assert mesh.cells(5).tangents is None
