"""Random surfaces of every kind, extreme ones among them."""

import itertools

import mesh_patches
import numpy as np

import coverable
from coverable import bspline, cylinder, mesh, piecewise, plane, revolution, sphere, torus
from surfaces.meshes.triangle_mesh import TriangleMesh


def _pose(rng):
    return {
        "side": str(rng.choice(["inside", "outside"])),
        "position": (rng.normal(size=3) * 10.0 ** rng.uniform(-2, 2)).tolist(),
        "rpy_deg": rng.uniform(-180.0, 180.0, 3).tolist(),
    }


def _decade(rng, low, high):
    return float(10.0 ** rng.uniform(low, high))


def _angles(rng, most=360.0):
    """A range of angles: often a full turn, sometimes a sliver."""
    low = rng.uniform(-360.0, 360.0)
    width = rng.choice([most, most * rng.uniform(0.01, 1.0), most * _decade(rng, -4, -1)])
    return low, low + width


def _polar(rng):
    ends = np.sort(rng.choice([0.0, 180.0, *rng.uniform(0.0, 180.0, 2)], 2, replace=False))
    return tuple(ends.tolist())


def _interval(rng, size):
    low = size * rng.normal()
    return low, low + size * _decade(rng, -3, 1)


def _plane(rng):
    size = _decade(rng, -3, 1)
    return plane(_interval(rng, size), _interval(rng, size), **_pose(rng))


def _sphere(rng):
    return sphere(_decade(rng, -3, 1), _polar(rng), _angles(rng), **_pose(rng))


def _cylinder(rng):
    radius = _decade(rng, -3, 1)
    return cylinder(radius, _angles(rng), _interval(rng, radius), **_pose(rng))


def _hyperboloid(rng):
    waist, flare = _decade(rng, -3, 0), _decade(rng, -3, 0)
    height = _interval(rng, rng.choice([waist, flare]))
    return coverable.hyperboloid(waist, flare, _angles(rng), height, **_pose(rng))


def _cone(rng):
    radius, slope = _decade(rng, -3, 0), rng.choice([-1, 1]) * _decade(rng, -4, 3)
    apex = -radius / slope
    near, far = sorted(_decade(rng, -4, 1) * abs(radius / slope) for _ in range(2))
    toward = -np.sign(apex)
    height = sorted((float(apex + toward * near), float(apex + toward * far)))
    return coverable.cone(radius, slope, _angles(rng), height, **_pose(rng))


def _torus(rng):
    ring = _decade(rng, -2, 0)
    share = rng.choice([_decade(rng, -5, 0), 1.0 - _decade(rng, -5, -1)])
    return torus(ring, ring * min(share, 0.99999), _angles(rng), _angles(rng), **_pose(rng))


def _ellipsoid(rng):
    axes = [_decade(rng, -3, 0) for _ in range(3)]
    return coverable.ellipsoid(axes, _polar(rng), _angles(rng), **_pose(rng))


def _revolution(rng):
    count = int(rng.integers(2, 12))
    z = np.cumsum(rng.uniform(0.02, 0.3, count))
    r = rng.uniform(0.05, 0.6, count)
    for end in (0, -1):
        if rng.uniform() < 0.4:
            r[end] = 0.0
    points = np.column_stack([r, z])
    return revolution(points[:: rng.choice([-1, 1])], _angles(rng), **_pose(rng))


def _bspline(rng):
    degree = tuple(int(d) for d in rng.integers(1, 6, 2))
    m, n = (int(d + rng.integers(1, 5)) for d in degree)
    x, y = np.meshgrid(np.linspace(0, 1, m), np.linspace(0, 1, n), indexing="ij")
    points = np.stack([x, y, 0.0 * x], axis=-1) + rng.normal(size=(m, n, 3)) * _decade(rng, -3, -1)
    weights = None if rng.uniform() < 0.4 else 10.0 ** rng.uniform(-1, 1, (m, n))
    ranges = [None if rng.uniform() < 0.5 else np.sort(rng.uniform(size=2)) for _ in range(2)]
    knots = [_knots(rng, count, d) for count, d in zip((m, n), degree, strict=True)]
    return bspline(points * _decade(rng, -1, 1), degree, knots, weights, *ranges, **_pose(rng))


def _knots(rng, count, degree):
    """Clamped, at random places, some of them twice."""
    if rng.uniform() < 0.5:
        return None
    inner = np.sort(np.round(rng.uniform(0.05, 0.95, count - degree - 1), 1))
    return np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])


def _piecewise(rng):
    if rng.uniform() < 0.5:
        turn = rng.uniform(-120.0, 120.0)
        plates = [
            plane((0.0, 0.2), (0.0, 0.2)),
            plane((-0.2, 0.0), (0.0, 0.2), rpy_deg=(0.0, turn, 0.0)),
        ]
        return piecewise(plates, **_pose(rng))
    cuts = np.linspace(-90.0, 90.0, int(rng.integers(2, 6)))
    pieces = [cylinder(0.3, ends, (0.0, 0.4)) for ends in itertools.pairwise(cuts)]
    return piecewise(pieces, **_pose(rng))


def _mesh(rng):
    nu, nv = (int(k) for k in rng.integers(1, 12, 2))
    u, v, faces = mesh_patches.grid(nu, nv)
    shape = int(rng.integers(3))
    if shape == 0:
        places = np.stack([u, v, rng.normal(scale=_decade(rng, -3, -0.5), size=len(u))], axis=1)
    elif shape == 1:
        angle = u * rng.uniform(0.1, 6.0)
        places = np.stack([np.cos(angle), np.sin(angle), v], axis=1)
    else:
        fold = np.abs(u - 0.5) * rng.uniform(0.1, 5.0)
        places = np.stack([u, v, fold], axis=1)
    scale = [_decade(rng, -2, 0), _decade(rng, -2, 0), 1.0]
    made = mesh(TriangleMesh(places * scale, faces), **_pose(rng))
    return made if rng.uniform() < 0.5 else made.cells(count=int(rng.integers(1, 9))).surface


KINDS = {
    make.__name__[1:]: make
    for make in (_plane, _sphere, _cylinder, _hyperboloid, _cone, _torus, _ellipsoid, _revolution,
                 _bspline, _piecewise, _mesh)
}  # fmt: skip


def random_surface(kind, rng):
    """A surface of the kind; numbers that make none are drawn again."""
    while True:
        try:
            return KINDS[kind](rng)
        except coverable.SurfaceError:
            continue
