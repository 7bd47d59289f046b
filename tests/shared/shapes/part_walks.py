"""Walks down trees of parts: whether places of a surface lie in what each part promises."""

from typing import NamedTuple

import numpy as np


class Used(NamedTuple):
    """How much of its radii a walk has used, over all places and the parts that they lie on."""

    points: float
    """Largest |f - model| / r_f."""
    normals: float
    """Largest |n - model| / r_n."""
    finest: np.ndarray
    """(k,) the finest part that each place ended on, one of them."""


def residuals(parts, part, x, points, normals):
    """(k, 2) |f - model| and |n - model| of places at x (k, 2) of parts (k,)."""
    model = parts.centre[part] + np.einsum("kc,kcd->kd", x, parts.slopes[part])
    off = np.hstack([points, normals]) - model
    return np.stack([np.linalg.norm(off[:, :3], axis=1), np.linalg.norm(off[:, 3:], axis=1)], 1)


def walk(parts, part, x, points, normals):
    """Follow places (k,) from parts (k,), at x (k, 2) of each, to the finest parts."""
    place, used = np.arange(len(x)), np.zeros(2)
    finest = np.full(len(x), -1)
    points, normals = np.asarray(points), np.asarray(normals)
    while len(place):
        off = residuals(parts, part, x, points[place], normals[place])
        used = np.maximum(used, (off / parts.radius[part]).max(axis=0))
        ends = parts.children[part, 0] < 0
        finest[place[ends]] = part[ends]
        place, part, x = place[~ends], part[~ends], x[~ends]
        axis = parts.axis[part]
        assert (axis >= 0).all(), "the halves of a box"
        along = x[np.arange(len(x)), axis]
        chosen = []
        for side, sign in ((0, 1.0), (1, -1.0)):
            there = np.flatnonzero(sign * along <= 0.0)
            turned = x[there].copy()
            turned[np.arange(len(there)), axis[there]] = 2.0 * along[there] + sign
            chosen.append((place[there], parts.children[part[there], side], turned))
        place, part, x = (np.concatenate(two) for two in zip(*chosen, strict=True))
    assert (finest >= 0).all()
    return Used(*used, finest)


def at_parameters(surface, u, v):
    """Roots (k,) of the patch's boxes that hold parameters (k,), and x (k, 2) in them."""
    low, high = surface.part_roots
    at = np.stack([u, v], axis=1)
    inside = ((at[:, None] >= low) & (at[:, None] <= high)).all(axis=2)
    assert inside.any(axis=1).all()
    root = inside.argmax(axis=1)
    return root, (2.0 * at - low[root] - high[root]) / (high[root] - low[root])


def boxes_of(surface, parts):
    """(K, 2) lower and upper parameters of every part of a patch that is one box."""
    (low,), (high,) = surface.part_roots
    low, high = np.tile(low, (len(parts), 1)), np.tile(high, (len(parts), 1))
    for part in np.flatnonzero(parts.children[:, 0] >= 0).tolist():
        axis = parts.axis[part]
        one, other = parts.children[part]
        for child in (one, other):
            low[child], high[child] = low[part], high[part]
        high[one, axis] = low[other, axis] = (low[part, axis] + high[part, axis]) / 2.0
    return low, high


def spread(surface, count, seed=7):
    """Parameters (k,) all over a patch, on its borders and corners too."""
    rng = np.random.default_rng(seed)
    share = rng.uniform(0.0, 1.0, (count, 2))
    edge = rng.uniform(size=(count, 2)) < 0.1
    share[edge] = np.round(share[edge])
    ends = np.array([surface.u_range, surface.v_range])
    return (ends[:, 0] + share * np.diff(ends)[:, 0]).T


def survivors(parts, points, normals):
    """(k,) which places reach a finest part through parts whose models all hold them.

    With x that brings the model nearest to the point: for parts whose slopes are square to each
    other. A search that discards only parts that cannot hold a place never loses a survivor.
    """
    place, part = np.arange(len(points)), np.zeros(len(points), dtype=int)
    reached = np.zeros(len(points), dtype=bool)
    while len(place):
        slopes = parts.slopes[part]
        away = points[place] - parts.centre[part, :3]
        square = np.maximum((slopes[..., :3] ** 2).sum(axis=2), 1e-300)
        x = np.clip(np.einsum("kcd,kd->kc", slopes[..., :3], away) / square, -1.0, 1.0)
        off = residuals(parts, part, x, points[place], normals[place])
        held = (off <= parts.radius[part]).all(axis=1)
        place, part = place[held], part[held]
        ends = parts.children[part, 0] < 0
        reached[place[ends]] = True
        place, part = np.repeat(place[~ends], 2), parts.children[part[~ends]].ravel()
    return reached


def size_of(surface):
    """m, about how large."""
    root = surface.parts(1.0, 1.0, 1)
    return float(root.radius[0, 0] + np.linalg.norm(root.slopes[0, :, :3], axis=1).sum())


def pieces_of(surface):
    """(patch, sign of its normals) of a patch, or of each piece and edge of a joined surface."""
    return surface.charts if surface.kind == "piecewise" else [(surface, 1.0)]


def lost(surface, rng, count=2000):
    """Whether a place's point or normal is outside the model of a part that it lies on."""
    flat = size_of(surface) * 10.0 ** rng.uniform(-4, -1)
    parts = surface.parts(flat, 10.0 ** rng.uniform(-3, 0), int(rng.integers(1, 3000)))
    if surface.kind == "mesh":
        face = rng.integers(len(surface.mesh.faces), size=count)
        weights = rng.dirichlet([0.5, 0.5, 0.5], count)
        places = surface.points_at(face, weights), surface.normals_at(face, weights)
        return not survivors(parts, *places).all()
    worst, pieces = 0.0, pieces_of(surface)
    for k, (patch, sign) in enumerate(pieces):
        u, v = spread(patch, count, int(rng.integers(2**31)))
        _, x = at_parameters(patch, u, v)
        first = np.full(count, len(pieces) - 1 + k)
        used = walk(parts, first, x, patch.point(u, v), sign * patch.normal(u, v))
        worst = max(worst, used.points, used.normals)
    return worst > 1.0
