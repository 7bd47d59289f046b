"""Cases whose surface is a file of points: a grid, or poses."""

import numpy as np
import pytest

from feasibility.cases import Case, CaseError

CASE = """
[robot]
name = "ur5"
[surface]
kind = "{kind}"
file = "{file}"
units = "mm"
side = "outside"
position = [0.1, 0.0, 0.0]
{more}
[task]
standoff = 0.02
cone_deg = 30
"""
PATH = "x,y,z,nx,ny,nz\n400,0,300,0,0,1\n400,100,300,0,0,1\n400,150,300,0,0,1\n"


@pytest.fixture
def folder(tmp_path):
    x, y = np.meshgrid([400.0, 500.0, 600.0], [-100.0, 0.0, 100.0, 200.0], indexing="ij")
    np.save(tmp_path / "grid.npy", np.stack([x, y, 300.0 + 0 * x], axis=2))
    (tmp_path / "path.csv").write_text(PATH)
    return tmp_path


def _case(folder, kind, file, more=""):
    return Case.from_toml(CASE.format(kind=kind, file=file, more=more), folder)


def test_a_grid_is_a_patch_through_its_points(folder):
    case = _case(folder, "grid", "grid.npy", "cells = [2, 3]")
    cells = case.build().cells
    assert cells.shape == (2, 3)
    np.testing.assert_allclose(cells.centres[0], [0.55, -0.05, 0.3], atol=1e-12)
    assert Case.from_toml(case.to_toml()) == case
    assert case.surface.label == "grid.npy"


def test_poses_are_cells_in_order_or_within_a_radius(folder):
    case = _case(folder, "poses", "path.csv")
    cells = case.build().cells
    np.testing.assert_allclose(cells.centres[2], [0.5, 0.15, 0.3], atol=1e-15)
    assert cells.in_order
    near = _case(folder, "poses", "path.csv", "neighbours = 0.07")
    assert near.build().cells.pairs.tolist() == [[1, 2]]
    for each in (case, near):
        assert Case.from_toml(each.to_toml()) == each
    assert near.surface.build().kind == "poses"


def test_a_piece_may_be_a_grid(folder):
    pieces = (
        'pieces = [{ kind = "grid", file = "grid.npy", units = "mm", cells = [2, 2] }]'.replace(
            "grid.npy", str(folder / "grid.npy")
        )
    )
    text = CASE.format(kind="piecewise", file="", more=pieces)
    text = text.replace('file = ""\n', "").replace('units = "mm"\nside', "side")
    assert len(Case.from_toml(text, folder).build().cells) == 4


def _faults(folder, kind, file, more="", drop=()):
    text = CASE.format(kind=kind, file=file, more=more)
    for line in drop:
        text = "\n".join(row for row in text.splitlines() if not row.startswith(line))
    with pytest.raises(CaseError) as caught:
        Case.from_toml(text, folder).build()
    return str(caught.value)


@pytest.mark.parametrize("kind", ["grid", "poses"])
def test_what_is_missing_is_named_all_at_once(folder, kind):
    text = _faults(folder, kind, "none.csv", "radius = 1", ("side", "units", "cells"))
    assert "surface.side: is missing; " in text
    assert "surface.units: is missing; it must be 'm' or 'mm'" in text
    assert "surface.radius" in text
    what = "a grid of points" if kind == "grid" else "a list of poses"
    assert f"there is no such file; expected {what}" in text
    assert ("surface.cells" in text) == (kind == "grid")


def test_what_is_wrong_in_files_is_said_with_their_names(folder):
    (folder / "bad.csv").write_text(PATH.replace("0,0,1\n400,100", "0,0,0\n400,nan"))
    text = _faults(folder, "poses", "bad.csv")
    assert "bad.csv" in text
    assert "line 3 'nan' is not a finite number" in text
    (folder / "bad.csv").write_text(PATH.replace("0,0,1\n400,100", "0,0,0\n400,100"))
    assert "normals[0] must have a direction" in _faults(folder, "poses", "bad.csv")
    (folder / "one.csv").write_text("".join(PATH.splitlines(keepends=True)[:2]))
    assert "at least 2 poses" in _faults(folder, "poses", "one.csv")
    bent = np.load(folder / "grid.npy")
    bent[1, 2, 2] = np.nan
    np.save(folder / "nan.npy", bent)
    text = _faults(folder, "grid", "nan.npy", "cells = [2, 3]")
    assert "nan.npy" in text
    assert "points[1][2][2] must be a finite number" in text


def test_keys_that_do_not_suit_poses_are_refused(folder):
    text = _faults(folder, "poses", "path.csv", 'cells = [2, 3]\nneighbours = "all"')
    assert "surface.cells: is not needed: each pose is a cell" in text
    assert "surface.neighbours: must be 'order', or a finite number > 0" in text
    text = _faults(folder, "poses", "path.csv", "neighbours = -0.1")
    assert "surface.neighbours" in text


def test_an_own_formula_is_led_to_what_takes_it(folder):
    text = _faults(folder, "formula", "x.py")
    assert "surfaces.parametric(g, u, v)" in text
    assert "'grid'" in text
