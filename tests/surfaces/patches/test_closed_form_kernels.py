"""The compiled patch: the same closest point as `Surface.closest`, and the cell it falls in."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from surfaces import cylinder, sphere
from surfaces.patches import cell_at, closest_on_patch, plane
from surfaces.patches.closed_form_kernels import wrap


def test_closest_point_equals_closest_to_the_last_bit(patch, samples):
    patch_kernel = patch.cells(7, 5).patch_kernel
    found = patch.closest(samples.point)
    for k in range(0, 2000, 20):
        u, v, height, nx, ny, nz = closest_on_patch(patch_kernel, *samples.point[k])
        assert (u, v, height) == (found.u[k], found.v[k], found.height[k])
        assert [nx, ny, nz] == found.normal[k].tolist()


def test_every_centre_falls_in_its_own_cell(patch):
    cells = patch.cells(7, 5)
    closest_points = patch.closest(cells.centres + 0.01 * cells.normals)
    for k in range(len(cells)):
        assert cell_at(cells.patch_kernel, cells.u[k], cells.v[k]) == k
        assert cell_at(cells.patch_kernel, closest_points.u[k], closest_points.v[k]) == k


def test_cell_at_counts_rows_and_columns(patch, samples):
    cells = patch.cells(4, 6)
    rows = np.searchsorted(np.linspace(*patch.u_range, 5), samples.u, side="right") - 1
    columns = np.searchsorted(np.linspace(*patch.v_range, 7), samples.v, side="right") - 1
    found = [cell_at(cells.patch_kernel, u, v) for u, v in zip(samples.u, samples.v, strict=True)]
    assert found == (rows * 6 + columns).tolist()


def test_outside_the_patch_there_is_no_cell():
    patch_kernel = plane((0, 0.6), (0, 0.4)).cells(3, 2).patch_kernel
    for u, v in [(-1e-6, 0.1), (0.600001, 0.1), (0.1, -0.1), (0.1, 0.5), (math.nan, 0.1)]:
        assert cell_at(patch_kernel, u, v) == -1
    assert cell_at(patch_kernel, 0.1, math.nan) == -1
    assert cell_at(patch_kernel, math.inf, 0.1) == -1


def test_the_rim_belongs_to_the_patch():
    patch_kernel = plane((0, 0.6), (0, 0.4)).cells(3, 2).patch_kernel
    assert cell_at(patch_kernel, 0.0, 0.0) == 0
    assert cell_at(patch_kernel, 0.6, 0.4) == 5
    assert cell_at(patch_kernel, 0.6 + 1e-12, -1e-12) == 4


@pytest.mark.parametrize(("nu", "nv"), [(0, 3), (3, 0), (0, 0)])
def test_an_empty_grid_has_no_cell_anywhere(nu, nv):
    assert cell_at(plane((0, 1), (0, 1)).cells(nu, nv).patch_kernel, 0.5, 0.5) == -1


def test_a_closed_parameter_may_be_off_by_turns():
    pipe = cylinder(0.3, (90, 450), (0, 1)).cells(8, 2)
    for turns in (-3, -1, 1, 2):
        for k in range(len(pipe)):
            assert cell_at(pipe.patch_kernel, pipe.u[k] + turns * math.tau, pipe.v[k]) == k


def test_a_closest_point_follows_across_the_seam():
    pipe = cylinder(0.3, (-180, 180), (0, 1)).cells(10, 1)
    found = []
    for angle in np.radians(np.arange(171, 190, 2)):
        u, v, *_ = closest_on_patch(
            pipe.patch_kernel, 0.2 * math.cos(angle), 0.2 * math.sin(angle), 0.5
        )
        found.append(cell_at(pipe.patch_kernel, u, v))
    assert found == [9] * 5 + [0] * 5


def test_a_closest_point_beyond_an_open_range_stays_outside_on_the_nearer_side():
    shell = cylinder(1.0, (120, 240), (0, 1))
    for degrees, expected in [(121, 121), (239, 239), (250, 250), (110, 110), (1, 361), (-1, -1)]:
        angle = math.radians(degrees)
        u, *_ = closest_on_patch(shell.patch_kernel(), math.cos(angle), math.sin(angle), 0.5)
        assert math.degrees(u) == pytest.approx(expected, abs=1e-9) or degrees in (1, -1)
        # Just past the opposite meridian either side is right; it must be outside in any case.
        inside = 120 <= degrees <= 240
        assert shell.closest([math.cos(angle), math.sin(angle), 0.5]).inside == inside


@given(
    st.floats(-50, 50),
    st.floats(-10, 10),
    st.floats(1e-3, 2 * math.pi),
)
def test_wrap_keeps_the_angle_and_goes_as_near_to_the_range_as_can_be(angle, low, width):
    high = low + width
    wrapped = wrap(angle, low, high)
    assert math.remainder(wrapped - angle, math.tau) == pytest.approx(0, abs=1e-12)

    def gap(a):
        return max(low - a, a - high, 0.0)

    assert gap(wrapped) <= gap(wrapped + math.tau) + 1e-12
    assert gap(wrapped) <= gap(wrapped - math.tau) + 1e-12


def test_a_chart_of_an_unknown_kind_gives_no_numbers():
    patch_kernel = sphere(1.0, (10, 90), (0, 90)).patch_kernel()._replace(code=99)
    assert np.isnan(closest_on_patch(patch_kernel, 0.1, 0.2, 0.3)).all()
