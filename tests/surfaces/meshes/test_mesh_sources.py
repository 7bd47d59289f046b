"""Objects in hand: their unit is honoured, and judged as that of a file is."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from surfaces import SurfaceError
from surfaces.meshes import TriangleMesh, mesh

METRES = {"mm": 1e-3, "millimeters": 1e-3, "cm": 1e-2, "in": 0.0254, "inches": 0.0254, "m": 1.0,
          "meters": 1.0, "feet": 0.3048, "microns": 1e-6, " MM ": 1e-3,
          "2.5 * mm": 2.5e-3}  # fmt: skip


def ball(radius, units=None):
    """A ball of trimesh, in some unit."""
    made = trimesh.creation.icosphere(subdivisions=1, radius=radius)
    if units is not None:
        made.units = units
    return made


def diameter(source, **options):
    return float(mesh(source, **options).mesh.extent.max())


@pytest.mark.parametrize("units", METRES)
def test_the_units_of_a_trimesh_are_honoured(units):
    metres = METRES[units]
    assert diameter(ball(0.3 / metres, units)) == pytest.approx(0.6, rel=1e-9)


def test_millimetres_without_units_are_refused_as_in_a_file():
    with pytest.raises(SurfaceError) as caught:
        mesh(ball(800))
    said = str(caught.value)
    assert "the part is 1600 m wide" in said
    assert "if the mesh is in millimetres give scale = 0.001 (1.6 m)" in said
    assert "scale = 1.0" in said
    assert diameter(ball(800), scale=0.001) == pytest.approx(1.6)
    assert diameter(ball(800), scale=1.0) == pytest.approx(1600.0)


@pytest.mark.parametrize("seed", range(20))
def test_what_is_refused_is_taken_with_any_of_the_scales_that_are_offered(seed):
    rng = np.random.default_rng(seed)
    units = rng.choice(["", "mm", "in", "m", "cm"])
    size = 10.0 ** rng.choice([rng.uniform(-9, -4), rng.uniform(1.5, 5)])
    metres = METRES.get(units, 1.0)
    source = ball(size / metres, units or None)
    with pytest.raises(SurfaceError, match=r"m wide; if .*scale = ") as caught:
        mesh(source)
    offers = [word.split()[0].rstrip(",") for word in str(caught.value).split("scale = ")[1:]]
    assert float(offers[-1]) == metres  # to insist on the size
    for offer in offers:
        assert diameter(source, scale=float(offer)) > 0.0


def test_a_scale_that_is_given_comes_before_units():
    assert diameter(ball(300, "mm"), scale=0.01) == pytest.approx(6.0)


@pytest.mark.parametrize("units", ["furlong", "1 * 2 * mm", "x * mm", "parsec", "angstroms"])
def test_units_that_nobody_can_use_are_refused(units):
    with pytest.raises(SurfaceError, match="the mesh"):
        mesh(ball(1.0, units))


@pytest.mark.parametrize("units", [None, "", "none", 3, object()])
def test_an_object_without_units_is_in_metres(units):
    plain = ball(0.3)
    source = SimpleNamespace(vertices=plain.vertices, faces=plain.faces, units=units)
    assert diameter(source) == pytest.approx(0.6)
    wide = SimpleNamespace(vertices=10.0 * plain.vertices, faces=plain.faces)
    assert any("6 m wide, wider than most arms reach" in note for note in mesh(wide).notes)


def test_a_triangle_mesh_is_in_metres_whatever_its_size():
    plain = ball(300.0)
    assert diameter(TriangleMesh(plain.vertices, plain.faces)) == pytest.approx(600.0)
