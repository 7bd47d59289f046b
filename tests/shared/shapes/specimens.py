"""Specimens of every kind of surface, extreme ones among them; and their formulas once more."""

import math

import numpy as np
from mesh_patches import bent, of_patch
from smooth_probes import POSE

import coverable
from coverable import bspline, ellipsoid, hyperboloid, piecewise, plane, revolution, sphere, torus
from surfaces.meshes.triangle_mesh import TriangleMesh

# Control nets of exact quadrics, and of a free form.

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


OUT = {"side": "outside"}
VASE = [(0.3, 0.0), (0.5, 0.2), (0.35, 0.5), (0.4, 0.8), (0.2, 1.0)]
EGG = [(0.0, -0.5), (0.3, -0.3), (0.35, 0.1), (0.2, 0.4), (0.0, 0.5)]
WEIGHTS = np.random.default_rng(3).uniform(0.5, 2.0, hood().shape[:2])
UNLIKE = 10.0 ** np.random.default_rng(11).uniform(-1.0, 1.0, (6, 7))
TWICE = np.array([0, 0, 0, 0, 0.5, 0.5, 1, 1, 1, 1])
PIPE, PIPE_WEIGHTS = turned([(0.5, -0.2), (0.5, 0.6)], [1, 1], *full_turn())
BARREL, BARREL_WEIGHTS = turned([(0.3, 0), (0.5, 0.5), (0.2, 1)], [1, 2, 1], *full_turn())
_Z = np.linspace(0.0, 1.0, 60)
RIPPLES = np.column_stack([0.3 + 0.003 * np.sin(20.0 * _Z), _Z])

SMOOTH = {
    "dome": sphere(1.0, (10, 90), (10, 180)),
    "ball": sphere(0.6, (0, 180), (-180, 180), **OUT, **POSE),
    "cap": sphere(2.5, (120, 180), (200, 560), **POSE),
    "shell": coverable.cylinder(0.8, (-60, 100), (0, 0.9)),
    "pipe": coverable.cylinder(0.2, (90, 450), (-3, -1), **OUT, **POSE),
    "horn": hyperboloid(0.5, 0.5, (0, 180), (0, 0.5)),
    "tower": hyperboloid(2.0, 3.0, (-180, 180), (-4, 1), **OUT, **POSE),
    "flat cone": hyperboloid(0.1, 0.03, (300, 420), (0.05, 0.2), **POSE),
    "sheet": plane((0.0, 0.6), (-0.4, 0.4)),
    "wall": plane((1, 2), (5, 9), **OUT, **POSE),
    "funnel": coverable.cone(0.2, 1.0, (0, 360), (-0.1, 0.4), **POSE),
    "spike": coverable.cone(0.5, -0.25, (-70, 100), (-0.3, 1.5), **OUT),
    "doughnut": torus(0.5, 0.2, (-180, 180), (0, 360), **OUT, **POSE),
    "bend": torus(0.8, 0.1, (30, 130), (100, 280)),
    "egg": ellipsoid((0.5, 0.6, 0.9), (0, 180), (10, 370), **POSE),
    "lens": ellipsoid((1.0, 1.0, 0.2), (5, 85), (-100, 60), **OUT),
    "vase": revolution(VASE, (0, 360), **POSE),
    "turned egg": revolution(EGG, (-30, 90)),
    "hood": bspline(hood(), **POSE),
    "part of degree 5": bspline(hood(9, 8), degree=(5, 2), u=(0.21, 0.77), v=(0.1, 0.5)),
    "rational": bspline(hood(), weights=WEIGHTS, u=(0.1, 0.8)),
    "spline pipe": bspline(PIPE, (2, 1), (TURN_KNOTS, None), PIPE_WEIGHTS, **POSE),
    "formula": coverable.parametric(
        lambda u, v: (u, v, 0.3 * np.sin(2 * u) * v), (0.0, 1.0), (0.0, 0.8), **POSE
    ),
}  # fmt: skip
CLOSED = {"ball": "v", "cap": "v", "pipe": "u", "tower": "u", "funnel": "u", "doughnut": "uv",
          "egg": "v", "vase": "v", "spline pipe": "u"}  # fmt: skip
POLES = {"ball": (True, True), "cap": (False, True), "egg": (True, True)}

EXTREME = {
    "trumpet": hyperboloid(0.01, 0.001, (0, 360), (-0.7, 1.0), **POSE),
    "almost a pipe": hyperboloid(0.3, 3000.0, (0, 360), (0.1, 1.0)),
    "needle": coverable.cone(0.2, 1.0, (0, 360), (-0.199999, 0.4)),
    "disc": coverable.cone(0.5, -400.0, (200, 300), (-0.002, 0.001), **POSE),
    "wire": torus(0.5, 0.0005, (0, 360), (0, 360)),
    "fat ring": torus(0.5, 0.4999, (0, 360), (90, 270)),
    "coin": ellipsoid((1.0, 0.8, 0.01), (0, 180), (-100, 260)),
    "cigar": ellipsoid((2.0, 0.1, 0.1), (0, 160), (30, 150), **POSE),
    "ripples": revolution(RIPPLES, (10, 70)),
    "flared": revolution([(0, 0), (0.05, 0.02), (0.06, 0.3), (0.07, 0.6), (0.5, 0.7)], (0, 100)),
    "rippled disc": revolution(RIPPLES[:, ::-1] + [0.1, 0.0], (10, 12)),
    "weights from 0.1 to 10": bspline(hood(), weights=UNLIKE, **OUT, **POSE),
    "barrel": bspline(BARREL, (2, 2), (TURN_KNOTS, None), BARREL_WEIGHTS, **POSE),
    "double knots": bspline(hood(6, 6), knots=(TWICE, None)),
    "bilinear": bspline([[(x, y, x * y) for y in (0, 1)] for x in (0, 1)], degree=(1, 1)),
    "far away": bspline(hood() + 1e3, weights=UNLIKE),
}


def ridge(count, turn_deg):
    tilt, half = np.radians(turn_deg / 2), lambda u: u - 0.5
    return coverable.mesh(TriangleMesh(*bent(
        lambda u, v: (half(u) * np.cos(tilt), 0.5 * v, -np.abs(half(u)) * np.sin(tilt)),
        2 * count, count,
    )))  # fmt: skip


def bowl(count):
    def shape(u, v):
        x, y = 0.8 * u - 0.4, 0.8 * v - 0.4
        return x, y, 0.6 * (x**2 + y**2) + 0.1 * x * y

    return coverable.mesh(TriangleMesh(*bent(shape, count - 1, count - 1)))


def flat(name, count=12):
    return coverable.mesh(TriangleMesh(*of_patch(SMOOTH[name], count, count)))


FACETED = {
    "mesh of the dome": flat("dome"),
    "bowl": bowl(14).cells(count=30).surface,
    "ridge": ridge(4, 70).cells(count=12).surface,
    "halves": piecewise([sphere(0.2, (0, 80), a) for a in ((0, 180), (180, 360))], **POSE),
    "can": piecewise(
        [coverable.cylinder(0.3, (0, 360), (0, 0.5)),
         ellipsoid((0.3, 0.3, 0.1), (0, 90), (0, 360), position=(0, 0, 0.5))], **OUT, **POSE,
    ),
    "flap": piecewise(
        [plane((0, 1), (0, 1)), plane((0, 1), (0, 1), position=(0, 1, 0), rpy_deg=(50, 0, 0))]
    ),
    "lid": piecewise(
        [coverable.cylinder(0.3, (0, 360), (0, 0.5)),
         coverable.cone(0.3, -0.6, (-90, 270), (0, 0.2), position=(0, 0, 0.5))], **OUT, **POSE,
    ),
    "turned over": piecewise(
        [plane((0.0, 0.2), (0.0, 0.2)), plane((0.0, 0.2), (0.0, 0.2), rpy_deg=(180, 0, 180))]
    ),
}  # fmt: skip
TILTED = {"position": (1.0, 2.0, 3.0), "rpy_deg": (20.0, -30.0, 50.0)}
ALL = {**SMOOTH, **FACETED}


def drawn(seed, count=25, **more):
    """A toolpath that wanders and tilts, placed askew."""
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0.0, 0.05, (count, 3)), axis=0)
    normals = np.array([0.0, 0.0, 2.0]) + rng.normal(0.0, 1.0, (count, 3))
    return coverable.poses(points, normals, **TILTED, **more)


def cells_of(surface, nu, nv):
    if surface.kind == "mesh":
        return surface.cells(count=max(nu * nv // 2, 1))
    if surface.kind == "piecewise":
        return surface.cells([(nu, nv)] * len(surface.pieces))
    return surface.cells(nu, nv)


# Formulas of spheres, tori and hyperboloids, beside the patches they are equal to.


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
    lines = [np.linspace(*ends, count) for ends, count in zip((u, v), counts, strict=True)]
    x, y = (part.reshape(-1) for part in np.meshgrid(*lines, indexing="ij"))
    points = formula(x, y)
    points = np.stack(points, axis=-1) if isinstance(points, tuple) else np.asarray(points)
    points = points.T if points.shape[0] == 3 else points
    return points.reshape(*counts, 3)
