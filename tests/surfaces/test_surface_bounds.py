"""Bounds on whole surfaces (parts, turning normals, curvatures) hold, and hardly less would do."""

import itertools
import math

import numpy as np
import pytest
from bounds import holds
from part_walks import boxes_of, lost
from random_surfaces import KINDS, random_surface
from samples import sampled, seeds, spread
from smooth_probes import POSE
from specimens import EXTREME, FACETED, SMOOTH

from coverable import hyperboloid, sphere
from coverable.errors import ArgumentError
from surfaces.patches.normal_bounds import bounds_of
from surfaces.patches.patch import ClosedFormPatch

PATCHES = {**SMOOTH, **EXTREME}
FLAT, STRAIGHT, MOST = 2e-3, 0.05, 60
GRID = np.array(list(itertools.product(np.linspace(-1.0, 1.0, 9), repeat=2)))


@pytest.fixture(scope="module", params=PATCHES, ids=str)
def patch(request):
    return PATCHES[request.param]


@pytest.fixture(scope="module")
def tree(patch):
    """Its parts, and off (K, 81, 2): how far points and normals in their boxes are off models."""
    parts = patch.parts(FLAT, STRAIGHT, MOST)
    low, high = boxes_of(patch, parts)
    u, v = np.moveaxis((low + high)[:, None] / 2.0 + GRID * (high - low)[:, None] / 2.0, 2, 0)
    values = np.concatenate([patch.point(u, v), patch.normal(u, v)], axis=2)
    models = parts.centre[:, None] + np.einsum("gc,kcd->kgd", GRID, parts.slopes)
    return parts, np.linalg.norm((values - models).reshape(*values.shape[:2], 2, 3), axis=3)


def test_parts_hold_all_their_places_and_smaller_radii_would_not(patch, tree):
    parts, off = tree
    assert patch.kind != "plane" or parts.radius.max() < 2e-12
    for k in (0, 1):
        flat = parts.radius[:, k].max() < 1e-11
        holds(parts.radius[:, k, None], off[..., k], used=0.0 if flat else 0.8)


@sampled("patch", spread([*PATCHES], 5), indirect=True)
def test_the_tree_is_one_and_is_cut_as_asked(patch, tree):
    parts, _ = tree
    inner = parts.children[:, 0] >= 0
    children = parts.children[inner]
    assert np.sort(children.ravel()).tolist() == list(range(1, len(parts)))
    assert (children > np.flatnonzero(inner)[:, None]).all()
    assert (parts.children[~inner] == -1).all()
    assert np.isfinite(parts.radius).all()
    for most in (1, 2, 20):
        fewer = patch.parts(FLAT, STRAIGHT, most)
        rough = (fewer.radius[fewer.children[:, 0] < 0] > [FLAT, STRAIGHT]).any()
        assert len(fewer) <= most
        assert not rough or len(fewer) + 2 > most
    flat = max(patch.parts(1.0, 1.0, 1).radius[0, 0] / 16.0, 1e-9)
    coarse, fine = (patch.parts(part * flat, 1e9, 1000) for part in (1.0, 0.25))
    assert len(fine) < 7 * len(coarse)  # halved sides: a quarter


@pytest.mark.parametrize("name", [n for n, s in FACETED.items() if s.kind == "piecewise"])
def test_parts_of_joined_surfaces_hold_their_places(name):
    surface, rng = FACETED[name], np.random.default_rng(1)
    assert any(surface.turned) == (name == "turned over")
    assert not any(lost(surface, rng) for _ in range(3))


@sampled("seed", seeds(1, all=300))
@pytest.mark.parametrize("kind", KINDS)
def test_random_surfaces_lie_in_their_parts(kind, seed):
    rng = np.random.default_rng([seed, *map(ord, kind)])
    surface = random_surface(kind, rng)
    assert not lost(surface, rng), surface


@sampled("seed", seeds(1, all=100))
def test_models_over_any_boxes_hold_their_places_and_hardly_less_would(patch, seed):
    """Points, normals and u directions: 10^6 places of each patch, of all sizes of boxes."""
    rng, ends = np.random.default_rng(seed), np.array([patch.u_range, patch.v_range])
    half = 0.5 * np.ptp(ends, axis=1) * 10.0 ** rng.uniform(-3, 0, (250, 2))
    middle = rng.uniform(ends[:, 0] + half, ends[:, 1] - half)
    x = np.concatenate([rng.uniform(-1, 1, (250, 31, 2)), np.tile(GRID[::10], (250, 1, 1))], axis=1)
    u, v = np.moveaxis(middle[:, None] + x * half[:, None], 2, 0)
    low, high = middle - half, middle + half
    both, along = patch.placed_models(low, high)[0].guarded(), patch.tangent_models(low, high)
    small, tiny = (half <= 0.02 * np.ptp(ends, axis=1)).all(axis=1), np.abs(ends).max() * 1e-14
    assert patch.kind != "bspline" or any(patch.net.closed) or both.radius[:, 1].max() < 0.5
    inner = (np.abs(x) < 0.99).all(axis=2)  # u directions are differences
    for k, values in enumerate((patch.point(u, v), patch.normal(u, v), patch.tangent(u, v))):
        half_of, model = min(k, 1), both if k < 2 else along
        some, radius = slice(3 * half_of, 3 * half_of + 3), model.radius[:, half_of]
        centre, slopes = model.centre[..., some], model.slopes[..., some]
        off = values - centre[:, None] - np.einsum("kgc,kcd->kgd", x, slopes)
        off = np.linalg.norm(off, axis=2) * (inner if k == 2 else 1.0)
        off[~np.isfinite(radius)] = 0.0
        holds(radius[:, None], off, used=0.0, tiny=(tiny, tiny, 1e-7)[k])
        large = small & (radius > (1e-9, 1e-9, 1e-5)[k]) & np.isfinite(radius)
        if large.sum() > 9:  # in fewer boxes 40 places each may all be off the worst ones
            holds(radius[large, None], off[large], used=0.9)


@pytest.mark.parametrize("limits", [(0.0, 1.0), (1.0, -1.0), (np.nan, 1.0), (1.0, np.nan)])
def test_limits_that_no_part_keeps_are_refused(limits):
    with pytest.raises(ArgumentError, match="above 0"):
        sphere(1.0, (10, 90), (0, 90)).parts(*limits)


WAISTS = {
    "bell": hyperboloid(0.5, 0.5, (0, 90), (0.1, 0.9)),
    "steep": hyperboloid(0.5, 0.15, (0, 90), (-0.05, 0.6), **POSE),
    "slim": hyperboloid(0.1, 0.4, (0, 90), (-0.3, 0.2)),
    "round": hyperboloid(0.7, 0.4, (0, 90), (0.3, 0.5)),
    "fan": hyperboloid(0.1, 0.02, (0, 90), (0.2, 0.4)),
}
BENT = {**{name: p for name, p in SMOOTH.items() if isinstance(p, ClosedFormPatch)}, **WAISTS}


def turning(surface, height, slack, count=8000):
    """Largest |Dm x| and |D^2 m[x, x]| of the normal field m, by central differences."""
    rng = np.random.default_rng(0)
    u, v = (rng.uniform(*ends, count) for ends in (surface.u_range, surface.v_range))
    h = height + slack * rng.uniform(-1, 1, count)
    points = surface.point(u, v) + h[:, None] * surface.normal(u, v)
    assert np.allclose(surface.closest(points).height, h), "the parallel surface meets itself"
    # Along the meridian, and anywhere.
    ahead = surface.point(u, v + 1e-7) - surface.point(u, v)
    ways = rng.normal(size=(count, 3))
    ways[: count // 2] = ahead[: count // 2] / np.linalg.norm(ahead, axis=1)[: count // 2, None]
    tilt = rng.uniform(-1.5, 1.5, (count // 2, 1))
    ways[: count // 2] += tilt * surface.normal(u, v)[: count // 2]
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    step = 1e-3 / max(bounds_of(surface, height, slack).curvature, 1.0)
    after, here, before = (surface.closest(points + s * step * ways).normal for s in (1, 0, -1))
    return (
        np.linalg.norm(after - before, axis=1) / (2 * step),
        np.linalg.norm(after - 2 * here + before, axis=1) / step**2,
    )


@pytest.mark.parametrize("share", [(0, 0), (0.3, 0), (0.3, 0.1), (-0.3, 0.05), (-0.6, 0.2), (2, 1)])
@pytest.mark.parametrize("name", BENT)
def test_normals_turn_no_faster_than_is_said(name, share):
    surface = BENT[name]
    if surface.kind == "plane":
        flat = bounds_of(surface, -5.0, 1.0)
        assert flat.curvature == flat.second_derivative == 0.0
        return
    radius = 1.0 / bounds_of(surface, 0.0).curvature
    height, slack = share[0] * radius, share[1] * radius
    bounds = bounds_of(surface, height, slack)
    if math.isinf(bounds.curvature):
        assert surface.kind == "hyperboloid"  # bends both ways, so normals meet on either side
        assert math.isinf(bounds.second_derivative)
        return
    first, second = turning(surface, height, slack)
    tight, least = slack == 0.0, 0.7 if surface.kind == "hyperboloid" else 0.93
    # Truncation of the differences is of the order of (step * curvature)^2.
    holds(bounds.curvature * (1 + 1e-5), first, used=0.93 * tight, tiny=1e-9)
    holds(bounds.second_derivative * (1 + 1e-4), second, used=least * tight, tiny=1e-6)
    wider = bounds_of(surface, height, slack + 0.01 * radius)
    assert wider.curvature >= bounds.curvature
    assert wider.second_derivative >= bounds.second_derivative


@pytest.mark.parametrize("name", SMOOTH)
def test_the_max_curvature_is_the_largest_of_many_directions(name):
    surface = SMOOTH[name]
    cells = surface.cells(4, 5)
    angle = np.linspace(0.0, math.pi, 90, endpoint=False)
    widths = [np.ptp(surface.u_range), np.ptp(surface.v_range)]
    u, v = cells.u[:, None], cells.v[:, None]
    rates = []
    for scale in (0.1, 1.0, 10.0):  # of parameters, whose units differ
        du, dv = 1e-5 * widths[0] * np.cos(angle) * scale, 1e-5 * widths[1] * np.sin(angle)
        turn = surface.normal(u + du, v + dv) - surface.normal(u - du, v - dv)
        step = surface.point(u + du, v + dv) - surface.point(u - du, v - dv)
        rates.append(np.linalg.norm(turn, axis=2) / np.linalg.norm(step, axis=2))
    best = np.max(rates, axis=(0, 2))
    assert (best <= cells.max_curvature * (1 + 1e-3) + 1e-6).all()
    assert (best >= cells.max_curvature * 0.97 - 1e-6).all()
