"""Control nets that the spline tests share: exact quadrics, and free forms."""

import math

import numpy as np

ROOT = math.sqrt(0.5)
TURN_KNOTS = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]) / 4.0


def quarter_turn():
    """(points, weights) of a quarter of the unit circle: degree 2, exact."""
    return np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.array([1.0, ROOT, 1.0])


def full_turn():
    """(points, weights) of the unit circle from nine points, with `TURN_KNOTS`."""
    x = np.array([1, 1, 0, -1, -1, -1, 0, 1, 1.0])
    y = np.array([0, 1, 1, 1, 0, -1, -1, -1, 0.0])
    return np.column_stack([x, y]), np.where(np.arange(9) % 2 == 1, ROOT, 1.0)


def turned(profile, profile_weights, turn, turn_weights):
    """(points, weights) of a profile (r, z) turned about z; u around, v along the profile."""
    r, z = np.asarray(profile, float).T
    around, along = np.broadcast_arrays(np.arange(len(turn))[:, None], np.arange(len(r)))
    points = np.stack(
        [turn[around, 0] * r[along], turn[around, 1] * r[along], z[along]], axis=-1
    )  # fmt: skip
    return points, np.outer(turn_weights, profile_weights)


def hood(m=6, n=7):
    """A free form like a car's hood, 1.2 m by 1.4 m."""
    x, y = np.meshgrid(np.linspace(-0.6, 0.6, m), np.linspace(-0.7, 0.7, n), indexing="ij")
    z = 0.15 * np.cos(1.4 * x) * np.cos(1.2 * y) + 0.03 * np.sin(4 * x) * y + 0.02 * x
    return np.stack([x, y, z], axis=-1)
