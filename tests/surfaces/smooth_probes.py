"""What any smooth patch is measured with: differences, triangles, and a search without slopes."""

import pickle
from itertools import pairwise

import numpy as np
import pytest

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


def least_distances(surface, points, u_range, v_range, count=121):
    """Distances of points from the patch over the ranges: a grid, and finer ones in its valleys."""
    u, v = np.linspace(*u_range, count), np.linspace(*v_range, count)
    grid = surface.point(u[:, None], v[None, :])
    mesh = max(np.linalg.norm(np.diff(grid, axis=k), axis=-1).max() for k in (0, 1))
    least = np.full(len(points), np.inf)
    for k, point in enumerate(points):
        distance = np.linalg.norm(grid - point, axis=-1)
        edged = np.pad(distance, 1, constant_values=np.inf)
        around = [np.roll(edged, by, axis=(0, 1)) for by in ((0, 1), (0, -1), (1, 0), (-1, 0))]
        valleys = np.argwhere(distance <= np.min(around, axis=0)[1:-1, 1:-1])
        for i, j in sorted(valleys.tolist(), key=lambda ij: distance[*ij])[:3]:
            if distance[i, j] - 2.0 * mesh > least[k]:  # its surroundings are no nearer either
                break
            least[k] = min(least[k], _least_near(surface, point, (u, v), (i, j)))
    return least


def _least_near(surface, point, lines, start):
    """Least distance in the valley around a point of a grid: ever finer grids, which may move."""
    at = [line[index] for line, index in zip(lines, start, strict=True)]
    reach = [2.0 * (line[1] - line[0]) for line in lines]
    for _ in range(30):
        fine = [
            np.clip(x + np.linspace(-r, r, 11), line[0], line[-1])
            for x, r, line in zip(at, reach, lines, strict=True)
        ]
        distance = np.linalg.norm(surface.point(fine[0][:, None], fine[1]) - point, axis=-1)
        best = np.unravel_index(distance.argmin(), distance.shape)
        for k in (0, 1):
            nearest = fine[k][best[k]]
            reach[k] *= 1.0 if abs(nearest - at[k]) > 0.5 * reach[k] else 0.4
            at[k] = nearest
    return distance.min()


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


def assert_normals_fit(shape, u, v, step=1e-5, least=1e-9):
    """Normals (returned) are unit, square to differences of points, and to the right-hand side."""
    normals = shape.normal(u, v)
    assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 1e-14
    du, dv = tangents(shape, u, v, step)
    assert np.einsum("ij,ij->i", np.cross(du, dv), normals).min() > 0  # neighbours clockwise
    for tangent in (du, dv):
        assert np.abs(np.einsum("ij,ij->i", tangent, normals)).max() < least
    return normals


def assert_closest_recovers(
    shape, reach, height=1e-14, normal=1e-11, parameter=1e-11, lever=np.ones_like, count=2000
):
    """Points at most `reach` off the patch lead back to where they were put, that exactly."""
    u, v = random_parameters(shape, count)
    h = np.random.default_rng(1).uniform(-reach, reach, count)
    n = shape.normal(u, v)
    found = shape.closest(shape.point(u, v) + h[:, None] * n)
    assert found.inside.all()
    assert np.abs(found.height - h).max() < height
    assert np.abs(found.normal - n).max() < normal
    assert np.abs(found.u - u).max() < parameter
    assert np.abs((found.v - v) * lever(u)).max() < parameter


def assert_pickles_and_moves(shape, motion):
    """A pickled copy is the same, and a moved one (returned) has everything moved."""
    assert same_surface(shape, pickle.loads(pickle.dumps(shape)))
    rotation, translation = motion
    moved = shape.moved(rotation, translation)
    u, v = random_parameters(shape, 100)
    points = shape.point(u, v)
    assert moved.point(u, v) == pytest.approx(points @ rotation.T + translation)
    assert moved.normal(u, v) == pytest.approx(shape.normal(u, v) @ rotation.T)
    closest_point = moved.closest((points + 0.01 * shape.normal(u, v)) @ rotation.T + translation)
    assert closest_point.height == pytest.approx(np.full(100, 0.01), abs=1e-14)
    assert closest_point.inside.all()
    assert (type(moved), moved.side) == (type(shape), shape.side)
    with pytest.raises(ValueError, match="read-only"):
        moved.rotation[0, 0] = 2.0
    return moved


def assert_curves_lie_on(surface, curves, count=21):
    """Within the deviations that they state; returns `count` points (E, count, 3) of each curve."""
    pair = np.repeat(np.arange(len(curves)), count)
    points, normals = curves.at(pair, np.tile(np.linspace(0, 1, count), len(curves)))
    on = surface.closest(points)
    assert on.inside.all()
    assert (np.abs(on.height) <= curves.deviations[pair, 0] + 1e-12).all()
    # The normal there may turn across the curve, where the surface bends more than along it.
    apart = np.linalg.norm(normals - on.normal, axis=1)
    assert (apart <= curves.deviations[pair, 1] + 1e-12).all()
    return points.reshape(-1, count, 3)
