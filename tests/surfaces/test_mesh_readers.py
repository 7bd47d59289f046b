"""What trimesh makes of the same mesh files, and their units."""

from types import SimpleNamespace

import mesh_writers as w
import numpy as np
import pytest
import trimesh
from approved import refused
from mesh_writers import GOOD
from scipy.spatial import cKDTree

from coverable import mesh
from surfaces.meshes.mesh_notes import notes_of
from surfaces.meshes.sources import read_mesh
from surfaces.meshes.triangle_mesh import TriangleMesh

V, F = w.cube()


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "ply", "off", "glb"])
def test_what_trimesh_writes_is_read(kind, tmp_path):
    """A second opinion on each format, on a surface with holes in it."""
    other = trimesh.creation.icosphere(3, radius=0.4)
    other.update_faces(np.arange(len(other.faces)) % 50 != 0)
    other.remove_unreferenced_vertices()
    data, path = other.export(file_type=kind), tmp_path / f"part.{kind[:3]}"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    found = read_mesh(path)
    w.assert_clean(found)
    ours = found.vertices[found.faces]
    assert len(ours) == len(other.faces)
    # Single precision where the format has no better, and the digits that trimesh writes.
    assert np.abs(ours - other.triangles).max() < 1e-7
    assert found.area == pytest.approx(other.area, rel=1e-6)


@pytest.mark.parametrize("name", ["text.ply", "big.ply", "nodes.glb"])
def test_trimesh_reads_the_same(name, tmp_path):
    """Rows with other columns, another byte order; and nodes of a scene in their places."""
    path = tmp_path / name
    path.write_bytes(GOOD[name])
    found = read_mesh(path)
    with path.open("rb") as stream:
        other = trimesh.load_scene(stream, file_type=name[-3:], process=False).to_mesh()
    ours, theirs = (each.vertices[each.faces].mean(axis=1) for each in (found, other))
    assert len(ours) == len(theirs)
    for some, others in ((ours, theirs), (theirs, ours)):
        assert cKDTree(some).query(others)[0].max() < 1e-6
    # Mirrored or not, every cube faces outwards.
    assert not any("inwards" in note for note in notes_of(found))


METRES = {"mm": 1e-3, "millimeters": 1e-3, "cm": 1e-2, "in": 0.0254, "inches": 0.0254, "m": 1.0,
          "meters": 1.0, "feet": 0.3048, "microns": 1e-6, " MM ": 1e-3,
          "2.5 * mm": 2.5e-3}  # fmt: skip


def ball(radius, units=None):
    made = trimesh.creation.icosphere(subdivisions=1, radius=radius)
    if units is not None:
        made.units = units
    return made


def diameter(source, **options):
    return float(mesh(source, **options).mesh.extent.max())


@pytest.mark.parametrize("units", METRES)
def test_the_units_of_a_trimesh_are_honoured(units):
    assert diameter(ball(0.3 / METRES[units], units)) == pytest.approx(0.6, rel=1e-9)
    assert diameter(ball(300, units), scale=0.01) == pytest.approx(6.0)  # comes before them


@pytest.mark.parametrize("units", [None, "", "none", 3, object()])
def test_an_object_without_units_is_in_metres(units):
    plain = ball(0.3)
    source = SimpleNamespace(vertices=plain.vertices, faces=plain.faces, units=units)
    assert diameter(source) == pytest.approx(0.6)
    wide = SimpleNamespace(vertices=10.0 * plain.vertices, faces=plain.faces)
    assert any("6 m wide, wider than most arms reach" in note for note in mesh(wide).notes)
    clean = TriangleMesh(1000.0 * plain.vertices, plain.faces)  # in metres whatever its size
    assert diameter(clean) == pytest.approx(600.0)
    half = mesh(clean, scale=0.5)
    assert half.mesh.area == pytest.approx(0.25 * clean.area, rel=1e-9)
    assert half.mesh.history == clean.history


def test_scales_units_and_names_that_are_none_are_refused(tmp_path, approved):
    path = tmp_path / "part.stl"
    path.write_bytes(w.stl(V, F))
    asked = [(path, {"scale": k}) for k in (0.0, -1.0, np.nan, np.inf, True, "1", 1e-300)]
    asked += [(each, {"scale": 0.0}) for each in (ball(1.0), TriangleMesh(V, F))]
    asked += [(ball(1.0, u), {}) for u in ("furlong", "1 * 2 * mm", "x * mm", "parsec", "angstrom")]
    asked += [(ball(800), {}), (ball(0.3, "mm"), {}), (ball(1.0), {"side": "above"})]
    said = [refused(mesh, source, **options) for source, options in asked]
    approved("scales and units refused", "\n".join(said))
