"""What any smooth patch is measured with: differences, triangles, and a search without slopes."""

import numpy as np

POSE = {"position": (0.3, -1.2, 0.7), "rpy_deg": (25.0, -40.0, 110.0)}


def random_parameters(surface, count=400):
    rng = np.random.default_rng(7)
    return rng.uniform(*surface.u_range, count), rng.uniform(*surface.v_range, count)


def triangle_area(surface, count):
    u, v = (np.linspace(*ends, count + 1) for ends in (surface.u_range, surface.v_range))
    p = surface.point(u[:, None], v[None, :])
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    halves = np.cross(b - a, c - a), np.cross(c - a, d - a)
    return sum(np.linalg.norm(half, axis=-1).sum() for half in halves) / 2


def extrapolated_area(surface, count):
    """Richardson's table on three triangulations, whose errors fall with h^2 and h^4."""
    a, b, c = (triangle_area(surface, n * count) for n in (1, 2, 4))
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
