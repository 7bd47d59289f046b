"""The formulas of spheres, tori and hyperboloids, beside the patches they are equal to."""

import numpy as np

from surfaces import hyperboloid, sphere, torus


def ball(u, v):
    return np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)


def ring(u, v):
    r = 0.5 + 0.125 * np.cos(v)
    return np.array([r * np.cos(u), r * np.sin(u), 0.125 * np.sin(v)])


def waist(u, v):
    r = 0.5 * np.sqrt(1.0 + (v / 0.5) ** 2)
    return np.stack([r * np.cos(u), r * np.sin(u), v], axis=-1)


def _deg(*pair):
    return tuple(np.radians(pair).tolist())


EQUAL = {
    "sphere": (ball, _deg(10, 90), _deg(10, 180), sphere(1.0, (10, 90), (10, 180))),
    "torus": (ring, _deg(0, 90), _deg(-80, 100), torus(0.5, 0.125, (0, 90), (-80, 100))),
    "hyperboloid": (
        waist, _deg(130, 220), (0.0, 0.5), hyperboloid(0.5, 0.5, (130, 220), (0.0, 0.5)),
    ),
}  # fmt: skip


def sampled(formula, u, v, counts):
    """(m, n, 3) points of a formula at equal steps."""
    lines = [np.linspace(*ends, count) for ends, count in zip((u, v), counts, strict=True)]
    x, y = (part.reshape(-1) for part in np.meshgrid(*lines, indexing="ij"))
    points = formula(x, y)
    points = np.stack(points, axis=-1) if isinstance(points, tuple) else np.asarray(points)
    points = points.T if points.shape[0] == 3 else points
    return points.reshape(*counts, 3)
