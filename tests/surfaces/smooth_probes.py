"""What any smooth patch is measured with: differences, triangles, and a search without slopes."""

import pickle
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import least_squares, minimize

POSE = {"position": (0.3, -1.2, 0.7), "rpy_deg": (25.0, -40.0, 110.0)}


def random_parameters(surface, count, seed=7):
    rng = np.random.default_rng(seed)
    return rng.uniform(*surface.u_range, count), rng.uniform(*surface.v_range, count)


def tangents(surface, u, v, step=1e-5):
    """Central differences of fourth order."""

    def slope(du, dv):
        near = surface.point(u + du, v + dv) - surface.point(u - du, v - dv)
        far = surface.point(u + 2 * du, v + 2 * dv) - surface.point(u - 2 * du, v - 2 * dv)
        return (8 * near - far) / (12 * step)

    return slope(step, 0.0), slope(0.0, step)


def triangle_area(surface, u, v):
    """Area of the triangles over a grid of parameters."""
    p = surface.point(u[:, None], v[None, :])
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    halves = np.cross(b - a, c - a), np.cross(c - a, d - a)
    return sum(np.linalg.norm(half, axis=-1).sum() for half in halves) / 2


def extrapolated_area(surface, breaks_u, breaks_v, pieces=48):
    """Richardson's table on three triangulations, whose errors fall with h^2 and h^4."""

    def line(breaks, count):
        return np.unique(
            np.concatenate([np.linspace(*ends, count + 1) for ends in pairwise(breaks)])
        )

    a, b, c = (
        triangle_area(surface, line(breaks_u, n), line(breaks_v, n))
        for n in (pieces, 2 * pieces, 4 * pieces)
    )
    ab, bc = b + (b - a) / 3, c + (c - b) / 3
    return bc + (bc - ab) / 15


def least_distance(surface, point, u_range, v_range, count=121):
    """Distance of a point from the patch over the ranges: a grid, then descents by differences."""
    u, v = np.linspace(*u_range, count), np.linspace(*v_range, count)
    grid = surface.point(u[:, None], v[None, :])
    distance = np.linalg.norm(grid - point, axis=-1)
    mesh = max(np.linalg.norm(np.diff(grid, axis=k), axis=-1).max() for k in (0, 1))
    edged = np.pad(distance, 1, constant_values=np.inf)
    around = [np.roll(edged, shift, axis=(0, 1)) for shift in ((0, 1), (0, -1), (1, 0), (-1, 0))]
    valleys = np.argwhere(distance <= np.min(around, axis=0)[1:-1, 1:-1])
    order = np.argsort([distance[i, j] for i, j in valleys])
    step = np.array([u[1] - u[0], v[1] - v[0]])
    bounds = np.array([u_range, v_range]) / step[:, None]

    def residual(x):
        return surface.point(*(x * step)) - point

    best = np.inf
    for i, j in valleys[order[:3]]:
        if distance[i, j] - 2.0 * mesh > best:  # too far for its surroundings to be nearer
            break
        start = np.clip(np.array([u[i], v[j]]) / step, bounds[:, 0] + 1e-3, bounds[:, 1] - 1e-3)
        found = least_squares(
            residual, start, "3-point", bounds.T, ftol=None, xtol=1e-12, gtol=1e-15, max_nfev=300
        )
        free = minimize(
            lambda x: float(np.linalg.norm(residual(x))), found.x, method="Nelder-Mead",
            bounds=bounds, options={"xatol": 1e-8, "fatol": 1e-16, "maxfev": 400},
        )  # fmt: skip
        best = min(best, free.fun)
    return best


def same_surface(one, other, tolerance=0.0):
    """Both give the same points, normals and closest points."""
    u, v = random_parameters(one, 200)
    points = one.point(u, v) + 0.01 * one.normal(u, v)
    a, b = one.closest(points), other.closest(points)
    pairs = [
        (one.point(u, v), other.point(u, v)),
        (one.normal(u, v), other.normal(u, v)),
        *((getattr(a, name), getattr(b, name)) for name in ("u", "v", "height", "normal")),
    ]
    agree = all(np.abs(first - second).max() <= tolerance for first, second in pairs)
    return agree and (a.inside == b.inside).all() and one.side == other.side


def assert_pickles_and_moves(shape, motion):
    """A pickled copy is the same, and a moved one (returned) has everything moved."""
    assert same_surface(shape, pickle.loads(pickle.dumps(shape)))
    rotation, translation = motion
    moved = shape.moved(rotation, translation)
    u, v = random_parameters(shape, 100)
    points = shape.point(u, v)
    assert moved.point(u, v) == pytest.approx(points @ rotation.T + translation)
    closest_point = moved.closest((points + 0.01 * shape.normal(u, v)) @ rotation.T + translation)
    assert closest_point.height == pytest.approx(np.full(100, 0.01), abs=1e-14)
    assert closest_point.inside.all()
    return moved
