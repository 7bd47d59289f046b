"""The look-up of a surface's places in its parts, and proofs over meshes, splines and pieces."""

from dataclasses import replace

import mesh_patches
import numpy as np
import pytest
from proof_cases import FLAT, elbow, elbow_case
from random_surfaces import KINDS, random_surface

from feasibility.certification import verify_proof
from feasibility.certification.cut_proofs.parts_agreement import (
    disagreement,
    on_a_finest_part,
    places,
)
from surfaces import bspline, mesh, piecewise, plane
from surfaces.meshes.triangle_mesh import TriangleMesh


def cells_of(surface):
    """A few cells, however the kind is cut."""
    if surface.kind == "mesh":
        return surface.cells(count=20)
    return surface.cells((3, 4)) if surface.kind == "piecewise" else surface.cells(4, 5)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(2))
def test_parts_hold_the_places_of_their_surface_and_not_those_of_another(kind, seed):
    cells = cells_of(random_surface(kind, np.random.default_rng(seed)))
    parts = cells.surface.parts(1e-2, 0.1, 2000)
    assert disagreement(cells, parts) == ""
    size = np.ptp(cells.centres, axis=0).max()
    moved = replace(parts, centre=parts.centre + np.repeat([size, 0.0], 3))
    assert "lie on no part" in disagreement(cells, moved)
    turned = replace(parts, centre=parts.centre * np.repeat([1.0, -1.0], 3))
    if parts.radius[parts.children[:, 0] < 0, 1].max() < 0.5:  # else normals may be anything
        assert "lie on no part" in disagreement(cells, turned)
    unknown = replace(parts, radius=np.full_like(parts.radius, np.nan))
    assert "lie on no part" in disagreement(cells, unknown)


def test_a_part_that_is_missing_is_noticed():
    cells = plane((0.0, 1.0), (0.0, 1.0)).cells(10, 10)
    parts = cells.surface.parts(1e-3, 0.1)
    halves = replace(
        parts,
        centre=np.vstack([parts.centre[:1], parts.centre[:1] - [0.25, 0, 0, 0, 0, 0]]),
        slopes=np.vstack([parts.slopes[:1], parts.slopes[:1] * [[[0.5], [1.0]]]]),
        radius=np.vstack([parts.radius[:1]] * 2),
        children=np.array([[1, 1], [-1, -1]]),
        axis=np.array([-1, -1]),
    )
    points, normals = places(cells, 300)
    held = on_a_finest_part(np.concatenate([points, normals], axis=1), halves)
    np.testing.assert_array_equal(held, points[:, 0] <= 0.5)


def strip_of(kind):
    """The strip of `proof_cases.strip` as a mesh, a spline patch or two pieces."""
    if kind == "mesh":
        u, v, faces = mesh_patches.grid(1, 10)
        corners = np.stack([0.99 + 0.02 * u, -0.25 + 0.5 * v, 0.0 * u], axis=1)
        return mesh(TriangleMesh(corners, faces), side="inside").cells(count=5)
    if kind == "spline":
        x, y = np.meshgrid([0.99, 1.01], np.linspace(-0.25, 0.25, 4), indexing="ij")
        net = np.stack([x, y, 0.0 * x], axis=2)
        return bspline(net, degree=(1, 3), side="inside").cells(1, 5)
    pieces = [plane((0.99, 1.01), span, side="inside") for span in ((-0.25, 0.0), (0.0, 0.25))]
    return piecewise(pieces, side="inside").cells((1, 3))


@pytest.mark.parametrize("kind", ["mesh", "spline", "pieces"])
def test_proofs_over_other_kinds_of_surface(tmp_path, kind):
    cells = strip_of(kind)
    case = elbow_case(tmp_path)
    right, left = np.argmax(cells.centres[:, 1]), np.argmin(cells.centres[:, 1])
    root = case.tree.root
    root = replace(
        root,
        below=replace(root.below, cell=int(right)),
        above=replace(root.above, cell=int(left)),
    )
    tree = replace(case.tree, root=root)
    check = verify_proof(case.robot, cells, FLAT, tree)
    assert check.accepted, check.refusal
    wide = elbow(tmp_path, q1=1.2)
    assert "leaf 1" in verify_proof(wide, cells, FLAT, tree).refusal
