"""Foreign judging: what arms, surfaces and bodies do, computed without any code of the product.

Arms are read from their URDF by xml; surfaces are their formulas; nearest places on
triangles are looked for on each that can have them; distances of bodies are python-fcl's. `judge`
samples a motion densely and lists what it does wrong. All inputs are plain numbers.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise, product
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import fcl
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline, CubicSpline
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
TAU = 2.0 * np.pi
SAME = 1e-9  # [m], [rad]: rounding between two computations of one number

# Rotations and placements.


def turn(rpy: ArrayLike) -> Floats:
    """(3, 3) Rz(yaw) Ry(pitch) Rx(roll), rad."""
    return Rotation.from_euler("xyz", rpy).as_matrix()


def placement(position: ArrayLike = (0, 0, 0), rpy: ArrayLike = (0, 0, 0)) -> Floats:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = turn(rpy), position
    return made


def about(axis: ArrayLike, angles: Floats) -> Floats:
    """(k, 3, 3) turns about a unit axis."""
    return Rotation.from_rotvec(np.outer(angles, axis)).as_matrix()


def unit(vectors: ArrayLike) -> Floats:
    vectors = np.asarray(vectors, float)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def angles_between(a: Floats, b: Floats) -> Floats:
    """rad between unit vectors (..., 3); exact near zero too."""
    return 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(a - b, axis=-1), 0.0, 1.0))


# Arms.


class Joint(NamedTuple):
    name: str
    kind: str
    parent: str
    child: str
    origin: Floats
    axis: Floats
    limits: tuple[float, float]


def _numbers(element: Any, key: str, default: str) -> Floats:
    """Of an attribute; what is left out has a default."""
    words = default if element is None else element.get(key) or default
    return np.array([float(word) for word in words.split()])


def joints_of(path: str | Path) -> list[Joint]:
    """The joints of a URDF file; limits are infinite where it has none."""
    found = []
    for element in ElementTree.parse(path).getroot().findall("joint"):
        origin, axis, limit = (element.find(tag) for tag in ("origin", "axis", "limit"))
        at = placement(_numbers(origin, "xyz", "0 0 0"), _numbers(origin, "rpy", "0 0 0"))
        along = _numbers(axis, "xyz", "1 0 0")
        free = limit is None or element.get("type") == "continuous"
        ends = (-np.inf, np.inf)
        if not free:
            ends = float(limit.get("lower", "0")), float(limit.get("upper", "0"))
        parent, child = (element.find(tag).get("link") for tag in ("parent", "child"))
        found.append(
            Joint(element.get("name"), element.get("type"), parent, child, at, along, ends)
        )
    return found


@dataclass
class Arm:
    """A tree of joints with a tool, as the URDF has it."""

    joints: list[Joint]
    tool_link: str
    names: Sequence[str]
    locked: Mapping[str, float] = field(default_factory=dict)
    tcp: Floats = field(default_factory=lambda: np.eye(4))
    approach: ArrayLike = (0.0, 0.0, 1.0)  # Of the tool, in the frame of its TCP
    reference: ArrayLike = (1.0, 0.0, 0.0)
    base: Floats = field(default_factory=lambda: np.eye(4))  # Of the root link, in the world
    seen_from: str | None = None  # The link in whose frame tools are given; None for the world
    limits: Floats | None = None  # (n, 2); by default those of the URDF

    def __post_init__(self) -> None:
        known = {joint.name: joint.limits for joint in self.joints}
        if self.limits is None:
            self.limits = np.array([known[name] for name in self.names])
        children = {joint.child for joint in self.joints}
        (self.root,) = {joint.parent for joint in self.joints} - children

    def carried(self, axes: Sequence[Mapping[str, Any]]) -> Arm:
        """The same on more axes (name, kind, axis, position, rpy [rad], carries) below it."""
        ends, made = {"base": "the world", "surface": "the world"}, []
        for one in axes:
            at, below = placement(one["position"], one["rpy"]), ends[one["carries"]]
            along = unit(one["axis"])
            made.append(
                Joint(one["name"], one["kind"], below, one["name"], at, along, (-np.inf, np.inf))
            )
            ends[one["carries"]] = one["name"]
        seat = Joint("seat", "fixed", ends["base"], self.root, self.base, np.zeros(3), (0.0, 0.0))
        return replace(self, joints=[*made, seat, *self.joints], base=np.eye(4))

    def frames(self, q: ArrayLike) -> dict[str, Floats]:
        """(k, 4, 4) of each link in the world, at configurations q (k, n)."""
        q = np.atleast_2d(np.asarray(q, float))
        found = {self.root: np.broadcast_to(self.base, (len(q), 4, 4))}
        values = dict(zip(self.names, q.T, strict=True))
        waiting = list(self.joints)
        while waiting:
            later = []
            for joint in waiting:
                if joint.parent not in found:
                    later.append(joint)
                    continue
                here = found[joint.parent] @ joint.origin
                if joint.kind in ("revolute", "continuous", "prismatic"):
                    held = self.locked.get(joint.name, 0.0)
                    value = values.get(joint.name, np.full(len(q), held))
                    moved, axis = np.tile(np.eye(4), (len(q), 1, 1)), unit(joint.axis)
                    if joint.kind == "prismatic":
                        moved[:, :3, 3] = value[:, None] * axis
                    else:
                        moved[:, :3, :3] = about(axis, value)
                    here = here @ moved
                found[joint.child] = here
            assert len(later) < len(waiting), "a joint hangs from no link"
            waiting = later
        return found

    def placed(self, q: ArrayLike) -> Floats:
        """(k, 4, 4) the TCP, in the world or as seen from a link."""
        frames = self.frames(q)
        here = frames[self.tool_link] @ self.tcp
        return here if self.seen_from is None else np.linalg.inv(frames[self.seen_from]) @ here

    def tool(self, q: ArrayLike) -> tuple[Floats, Floats, Floats]:
        here = self.placed(q)
        approach = unit(self.approach)
        reference = np.asarray(self.reference, float)
        reference = unit(reference - (reference @ approach) * approach)
        return here[:, :3, 3], here[:, :3, :3] @ approach, here[:, :3, :3] @ reference


# Surfaces.


class Places(NamedTuple):
    points: Floats  # (k, 3) m
    normals: Floats  # (k, 3) unit, outward
    along: Floats  # (k, 3) unit, where the parameter u grows; NaN where there is none


def turned_curve(kind: str, size: Sequence[float]) -> Callable[..., Floats]:
    """(r, z) of what a surface of revolution is turned from, as curve(s, order of derivative)."""

    def curve(s: Floats, order: int = 0) -> Floats:
        phase, none = s + 0.5 * np.pi * order, np.zeros_like(s)
        if kind == "sphere":
            return size[0] * np.stack([np.sin(phase), np.cos(phase)], -1)
        if kind == "torus":
            ring = size[0] if order == 0 else 0.0
            return np.stack([ring + size[1] * np.cos(phase), size[1] * np.sin(phase)], -1)
        if kind == "hyperboloid":
            waist, flare = size
            r = waist * np.sqrt(1.0 + (s / flare) ** 2)
            r = (r, waist**2 * s / (flare**2 * r), waist**4 / (flare**2 * r**3))[order]
        else:
            slope = size[1] if kind == "cone" else 0.0
            r = (size[0] + slope * s, slope + none, none)[order]
        return np.stack([r, (s, none + 1.0, none)[order]], -1)

    return curve


@dataclass
class Form:
    """A patch of a surface by its formula. Lengths in m, angles in rad."""

    kind: str
    # Sphere, cylinder (r); cone (r, slope); torus (ring, tube); hyperboloid (waist, flare);
    # ellipsoid (a, b, c); else ().
    size: Sequence[float]
    u: tuple[float, float]
    v: tuple[float, float]
    outside: bool
    position: ArrayLike = (0.0, 0.0, 0.0)
    rotation: ArrayLike = field(default_factory=lambda: np.eye(3))
    # (u, v) to points (k, 3) in its own frame, for other kinds; of a revolution its `spline_curve`.
    formula: Callable[..., Floats] | None = None

    def __post_init__(self) -> None:
        self.position, self.rotation = np.array(self.position), np.array(self.rotation)
        if self.kind in ("sphere", "torus", "cylinder", "cone", "hyperboloid"):
            self.formula = turned_curve(self.kind, self.size)

    @property
    def sign(self) -> float:
        """+1 where the tool works on the outer side."""
        return 1.0 if self.outside else -1.0

    @property
    def along_curve(self) -> int | None:
        """Which parameter runs along the curve that is turned about z (the other is the angle)."""
        return {"sphere": 0, "revolution": 0, "torus": 1, "cylinder": 1, "cone": 1,
                "hyperboloid": 1}.get(self.kind)  # fmt: skip

    def local(self, u: Floats, v: Floats) -> Places:
        """Places in the own frame."""
        u, v = np.broadcast_arrays(u, v)
        zero = np.zeros_like(u)
        if self.kind == "plane":
            normal = np.stack([zero, zero, zero + 1.0], -1)
            return Places(np.stack([u, v, zero], -1), normal, normal[:, [2, 0, 1]])
        if self.kind == "ellipsoid":
            ball = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], -1)
            along = np.stack([np.cos(u) * np.cos(v), np.cos(u) * np.sin(v), -np.sin(u)], -1)
            return Places(ball * self.size, unit(ball / self.size), unit(along * self.size))
        if self.along_curve is None:
            return self._by_differences(u, v)
        s, angle = (u, v) if self.along_curve == 0 else (v, u)
        (r, z), (dr, dz) = (self.formula(s, order).T[:, :, None] for order in (0, 1))
        out = np.stack([np.cos(angle), np.sin(angle), zero], -1)
        up, side = np.array([0.0, 0.0, 1.0]), np.stack([-np.sin(angle), np.cos(angle), zero], -1)
        normal, along = unit(dz * out - dr * up), unit(dr * out + dz * up)
        if self.along_curve == 0:
            return Places(r * out + z * up, -normal, along)
        return Places(r * out + z * up, normal, side)

    def _by_differences(self, u: Floats, v: Floats) -> Places:
        """Of a formula: five-point differences for its tangents, inside the ranges."""
        sides = []
        for way, (low, high) in ((np.array([1.0, 0.0]), self.u), (np.array([0.0, 1.0]), self.v)):
            h = 1e-4 * (high - low)
            x = np.clip(u if way[0] else v, low + 2 * h, high - 2 * h)
            at = [
                self.formula(*((x + k * h, v) if way[0] else (u, x + k * h)))
                for k in (-2, -1, 1, 2)
            ]
            sides.append((at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * h))
        return Places(self.formula(u, v), unit(np.cross(*sides)), unit(sides[0]))

    def at(self, u: ArrayLike, v: ArrayLike) -> Places:
        """Places in the root frame."""
        own = self.local(np.atleast_1d(np.asarray(u, float)), np.atleast_1d(np.asarray(v, float)))
        points = own.points @ self.rotation.T + self.position
        return Places(points, own.normals @ self.rotation.T, own.along @ self.rotation.T)

    def centres(self, nu: int, nv: int) -> Places:
        """The middles of cells of equal parameters, row by row."""
        (u0, u1), (v0, v1) = self.u, self.v
        u = np.repeat(u0 + (u1 - u0) * (np.arange(nu) + 0.5) / nu, nv)
        v = np.tile(v0 + (v1 - v0) * (np.arange(nv) + 0.5) / nv, nu)
        return self.at(u, v)

    def nearest(self, points: Floats) -> tuple[Floats, Floats]:
        """Parameters (k,) of the patch's places nearest to points (k, 3) of the root frame."""
        x, y, z = ((points - self.position) @ self.rotation).T
        if self.kind == "plane":
            return np.clip(x, *self.u), np.clip(y, *self.v)
        if self.along_curve is None:
            return self._looked_for(points)
        turns, ends = (self.v, self.u) if self.along_curve == 0 else (self.u, self.v)
        middle = 0.5 * (turns[0] + turns[1])
        angle = middle + (np.arctan2(y, x) - middle + np.pi) % TAU - np.pi
        found = self._along_the_curve(np.hypot(x, y), z, ends), np.clip(angle, *turns)
        return found if self.along_curve == 0 else found[::-1]

    def _along_the_curve(self, across: Floats, z: Floats, ends: tuple[float, float]) -> Floats:
        """Nearest to (across, z) in the half plane: the best of many, bettered by Newton."""
        some, point = np.linspace(*ends, 2001), np.stack([across, z], -1)
        s = some[cKDTree(self.formula(some)).query(point)[1]]
        for _ in range(8):
            at, d1, d2 = (self.formula(s, order) for order in range(3))
            off = at - point
            bend = (d1 * d1).sum(1) + (off * d2).sum(1)
            s = np.clip(s - (off * d1).sum(1) / np.where(bend > 0.0, bend, np.inf), *ends)
        return s

    @cached_property
    def _samples(self) -> tuple[cKDTree, Floats, Floats]:
        u, v = (np.linspace(*ends, 161) for ends in (self.u, self.v))
        u, v = (part.ravel() for part in np.meshgrid(u, v, indexing="ij"))
        return cKDTree(self.at(u, v).points), u, v

    def _looked_for(self, points: Floats) -> tuple[Floats, Floats]:
        """From the nearest of 161 x 161 samples by Gauss-Newton steps, within the ranges."""
        tree, u, v = self._samples
        first = tree.query(points)[1]
        place = np.stack([u[first], v[first]])
        h = np.array([1e-6 * (self.u[1] - self.u[0]), 1e-6 * (self.v[1] - self.v[0])])
        low, high = np.array([self.u, self.v]).T[:, :, None]
        for _ in range(6):
            here, base = self.at(*place).points, np.clip(place, low + h[:, None], high - h[:, None])
            sides = [
                (self.at(*(base + d)).points - self.at(*(base - d)).points) / (2 * d.sum())
                for d in (h[:, None] * np.eye(2)[:, k, None] for k in range(2))
            ]
            a, b, away = *sides, points - here
            aa, ab, bb = (a * a).sum(1), (a * b).sum(1), (b * b).sum(1)
            ra, rb = (a * away).sum(1), (b * away).sum(1)
            det = np.maximum(aa * bb - ab * ab, 1e-30)
            step = np.stack([bb * ra - ab * rb, aa * rb - ab * ra]) / det
            nearer = np.clip(place + step, low, high)
            better = np.linalg.norm(self.at(*nearer).points - points, axis=1) < np.linalg.norm(
                away, axis=1
            )
            place = np.where(better, nearer, place)
        return place[0], place[1]

    def over(self, points: Floats, standoff: float) -> list[Places]:
        """Where the nearest place to tool points may be; one way to look at it."""
        return [self.at(*self.nearest(points))]


def spline_curve(rz: ArrayLike) -> Callable[..., Floats]:
    """The spline through a profile (n, 2), over its chord length; called as curve(s, order)."""
    rz = np.asarray(rz, float)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rz, axis=0), axis=1))])
    on_axis = rz[0, 0] == 0.0, rz[-1, 0] == 0.0
    ends = [tuple((k, 0.0) if pole else "not-a-knot" for pole in on_axis) for k in (2, 1)]
    r, z = (CubicSpline(s, x, bc_type=bc) for x, bc in zip(rz.T, ends, strict=True))
    return lambda u, order=0: np.stack([r(u, order), z(u, order)], -1)


def spline_sheet(points: Floats, degree: tuple, knots: tuple, weights: Any = None) -> Callable:
    """The formula of a B-spline, summed over its basis."""
    m, n = points.shape[:2]
    weights = np.ones((m, n)) if weights is None else weights

    def formula(u: Floats, v: Floats) -> Floats:
        basis = [
            BSpline(k, np.eye(count), p)(x).T
            for k, p, count, x in zip(knots, degree, (m, n), np.broadcast_arrays(u, v), strict=True)
        ]
        share = np.einsum("ik,jk,ij->kij", *basis, weights)
        return np.einsum("kij,ijc->kc", share, points) / share.sum(axis=(1, 2))[:, None]

    return formula


@dataclass
class Pieces:
    """Several patches that are one surface; a tool may be over any of them."""

    pieces: Sequence[Form]

    @property
    def sign(self) -> float:
        return self.pieces[0].sign

    def over(self, points: Floats, standoff: float) -> list[Places]:
        """On each piece; and on what is nearest of all, with the normal that leads to the point,
        where that is on two pieces: round an edge it turns from one's to the other's."""
        found = [one.over(points, standoff)[0] for one in self.pieces]
        away = np.stack([points - place.points for place in found])
        far = np.linalg.norm(away, axis=2)
        first, row = far.argmin(axis=0), np.arange(len(points))
        shared = (far <= far.min(axis=0) + SAME).sum(axis=0) > 1
        ahead = self.sign * away[first, row] / np.maximum(far[first, row], SAME)[:, None]
        normals = np.where(shared[:, None], ahead, np.nan)
        edge = np.stack([place.points for place in found])[first, row]
        return [*found, Places(edge, normals, np.full_like(edge, np.nan))]


class Facets:
    """Triangles with normals between those of their corners, weighted by angles."""

    def __init__(self, vertices: Floats, faces: NDArray[np.int64], outside: bool) -> None:
        self.sign, self.corners = 1.0 if outside else -1.0, vertices[faces]
        a, b, c = self.corners.swapaxes(0, 1)
        self.flat = unit(np.cross(b - a, c - a))
        sums = np.zeros_like(vertices)
        for k in range(3):
            ahead, behind = (self.corners[:, (k + i) % 3] - self.corners[:, k] for i in (1, 2))
            share = angles_between(unit(ahead), unit(behind))[:, None]
            np.add.at(sums, faces[:, k], share * self.flat)
        self.normals = unit(np.where(np.abs(sums).sum(axis=1, keepdims=True) > 0, sums, 1.0))[faces]
        middles = self.corners.mean(axis=1)
        radii = np.linalg.norm(self.corners - middles[:, None], axis=2).max(axis=1)
        # Large triangles apart from small ones, so that few are looked at.
        self.sizes = [
            (some, cKDTree(middles[some]), radii[some].max())
            for some in np.array_split(np.argsort(radii), 5)
            if len(some)
        ]
        self.vertices = cKDTree(vertices[np.unique(faces)])

    def nearest(self, points: Floats) -> tuple[NDArray[np.int64], Floats]:
        """The nearest triangle to each point (k, 3), and the place's weights (k, 3) on it."""
        most = self.vertices.query(points)[0] + 1e-12
        rows, faces = [], []
        for some, tree, radius in self.sizes:
            # A triangle with its middle farther off than this cannot hold the closest point.
            found = tree.query_ball_point(points, most + radius)
            rows.append(np.repeat(np.arange(len(points)), [len(f) for f in found]))
            faces.append(some[np.concatenate(found).astype(np.int64)])
        row, face = np.concatenate(rows), np.concatenate(faces)
        weights, away = on_triangles(points[row], self.corners[face])
        order = np.lexsort((away, row))
        first = order[np.searchsorted(row[order], np.arange(len(points)))]
        return face[first], weights[first]

    def at(self, face: NDArray[np.int64], weights: Floats) -> Places:
        points = np.einsum("kc,kci->ki", weights, self.corners[face])
        normals = unit(np.einsum("kc,kci->ki", weights, self.normals[face]))
        return Places(points, normals, np.full_like(points, np.nan))

    def distance(self, points: Floats) -> Floats:
        """(k,) m."""
        return np.linalg.norm(self.at(*self.nearest(points)).points - points, axis=1)

    def over(self, points: Floats, standoff: float) -> list[Places]:
        """Where x + height n(x) comes nearest to the tool points, by iteration."""
        height, found = self.sign * standoff, self.at(*self.nearest(points))
        for _ in range(30):
            again = self.at(*self.nearest(points - height * found.normals))
            moved = np.linalg.norm(again.points - found.points, axis=1).max()
            found = again
            if moved < 1e-7:
                break
        return [found]


def on_triangles(points: Floats, corners: Floats) -> tuple[Floats, Floats]:
    """Weights (k, 3) of each triangle's closest place to its point, and their distance."""
    a, b, c = corners.swapaxes(0, 1)
    across = np.cross(b - a, c - a)
    square = np.einsum("ki,ki->k", across, across)
    square = np.where(square > 0.0, square, np.nan)
    second = np.einsum("ki,ki->k", np.cross(points - a, c - a), across) / square
    third = np.einsum("ki,ki->k", np.cross(b - a, points - a), across) / square
    best = np.column_stack([1.0 - second - third, second, third])
    away = np.linalg.norm(np.einsum("kc,kci->ki", best, corners) - points, axis=1)
    away[~(best >= 0.0).all(axis=1)] = np.inf
    for i, j in ((0, 1), (1, 2), (2, 0)):
        start, side = corners[:, i], corners[:, j] - corners[:, i]
        length = np.einsum("ki,ki->k", side, side)
        t = np.einsum("ki,ki->k", points - start, side) / np.where(length > 0.0, length, 1.0)
        t = np.clip(t, 0.0, 1.0)
        off = np.linalg.norm(start + t[:, None] * side - points, axis=1)
        nearer = off < away
        best[nearer] = 0.0
        best[nearer, i], best[nearer, j] = 1.0 - t[nearer], t[nearer]
        away = np.minimum(away, off)
    return best, away


# Bodies, by python-fcl.

TOUCHING = -1e-3  # m, in place of the distance of bodies that share a point: fcl does not know it
DEEP = 20.0  # m, a box in place of a half space: fcl crashes on a half space beside a mesh


class Shape(NamedTuple):
    link: str | None  # That it moves with; None for the root frame
    placement: Floats  # (4, 4) in the link's frame
    geometry: Any
    """('box', size), ('sphere', radius), ('capsule' or 'cylinder', radius, length along z),
    ('halfspace',) below z = 0, ('mesh', corners (F, 3, 3))."""
    off: float = 0.0  # m, what the shape may stand out further than this


def fcl_object(geometry: tuple) -> Any:
    match geometry:
        case ("box", size):
            return fcl.Box(*size)
        case ("sphere", radius):
            return fcl.Sphere(radius)
        case ("capsule", radius, length):
            return fcl.Capsule(radius, length)
        case ("cylinder", radius, length):
            return fcl.Cylinder(radius, length)
        case ("halfspace",):
            return fcl.Box(DEEP, DEEP, DEEP)
        case ("mesh", corners):
            model = fcl.BVHModel()
            model.beginModel(3 * len(corners), len(corners))
            model.addSubModel(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
            model.endModel()
            return model
    raise TypeError(geometry)


def radius_about(geometry: tuple) -> float:
    """m, no point of the shape is further from its origin."""
    match geometry:
        case ("box", size):
            return 0.5 * float(np.linalg.norm(size))
        case ("sphere", radius):
            return radius
        case ("capsule" | "cylinder", radius, length):
            return radius + 0.5 * length
        case ("mesh", corners):
            return float(np.linalg.norm(corners, axis=2).max())
    return np.inf


def link_bodies(path: str | Path, folders: Sequence[str | Path] = ()) -> dict[str, list[Shape]]:
    """The collision shapes of a URDF's links, meshes read by trimesh."""
    import trimesh

    found: dict[str, list[Shape]] = {}
    for link in ElementTree.parse(path).getroot().findall("link"):
        for part in link.findall("collision"):
            origin = part.find("origin")
            at = placement(_numbers(origin, "xyz", "0 0 0"), _numbers(origin, "rpy", "0 0 0"))
            (shape,) = part.find("geometry")
            match shape.tag:
                case "box":
                    made = ("box", tuple(_numbers(shape, "size", "")))
                case "sphere":
                    made = ("sphere", float(shape.get("radius")))
                case "cylinder" | "capsule":
                    made = (shape.tag, float(shape.get("radius")), float(shape.get("length")))
                case "mesh":
                    name = re.sub(r"^(package|model|file)://", "", shape.get("filename"))
                    tried = [Path(path).parent, *map(Path, folders)]
                    file = next(f for folder in tried if (f := folder / name).is_file())
                    corners = trimesh.load(file, force="mesh").triangles
                    made = ("mesh", np.asarray(corners) * _numbers(shape, "scale", "1 1 1"))
            found.setdefault(link.get("name"), []).append(Shape(link.get("name"), at, made))
    return found


class Scene:
    """Bodies of an arm and around it; `pairs` are names and what they have to stay apart by (m)."""

    def __init__(
        self,
        arm: Arm,
        bodies: Mapping[str, Sequence[Shape]],
        pairs: Sequence[tuple[str, str, float]],
    ) -> None:
        self.arm, self.pairs = arm, list(pairs)
        asked = {name for pair in pairs for name in pair[:2]}
        self.bodies = {
            name: [(shape, fcl_object(shape.geometry)) for shape in bodies[name]] for name in asked
        }

    def _placed(self, shape: Shape, model: Any, frames: Mapping[str, Floats]) -> Any:
        at = shape.placement if shape.link is None else frames[shape.link][0] @ shape.placement
        if shape.geometry[0] == "halfspace":
            at = at.copy()
            at[:3, 3] -= 0.5 * DEEP * at[:3, 2]
        return fcl.CollisionObject(model, fcl.Transform(at[:3, :3], at[:3, 3]))

    def distances(self, q: ArrayLike, asked: Sequence[int] | None = None) -> Floats:
        """(pairs,) m at one configuration; `TOUCHING` where bodies share a point."""
        frames, found = self._frames(np.atleast_2d(q)), []
        for k in range(len(self.pairs)) if asked is None else asked:
            least = np.inf
            for a, b, off in self._shapes(k, frames):
                touch = fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult())
                apart = TOUCHING if touch else fcl.distance(a, b, fcl.DistanceRequest())
                least = min(least, apart - off)
            found.append(least)
        return np.array(found)

    def _shapes(self, k: int, frames: Mapping[str, Floats]) -> Iterator[tuple[Any, Any, float]]:
        """Each shape of a pair's first body with each of its second; how far they stand out."""
        for one, other in product(*(self.bodies[name] for name in self.pairs[k][:2])):
            off = one[0].off + other[0].off
            yield self._placed(*one, frames), self._placed(*other, frames), off

    def _frames(self, q: Floats) -> dict[str, Floats]:
        frames = self.arm.frames(q)
        if self.arm.seen_from is None:
            return frames
        back = np.linalg.inv(frames[self.arm.seen_from])
        return {name: back @ frame for name, frame in frames.items()}

    def least_excess(self, rows: Floats) -> Floats:
        """(pairs,) m, the least distance of each over what is asked, at any row of a motion."""
        # No point moves further than its reach times the joints' turns: where a pair is further
        # apart than that, it is not asked for again.
        sliding = [j.name for j in self.arm.joints if j.kind == "prismatic"]
        reach = sum(np.linalg.norm(joint.origin[:3, 3]) for joint in self.arm.joints)
        reach += sum(np.abs(self.arm.limits[k]).max() for k, name in enumerate(self.arm.names)
                     if name in sliding)  # fmt: skip
        wide = [
            np.linalg.norm(shape.placement[:3, 3]) + radius_about(shape.geometry)
            for shapes in self.bodies.values()
            for shape, _ in shapes
            if shape.link is not None
        ]
        most = max(1.0, reach + max(wide, default=0.0))
        way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(rows, axis=0)).sum(axis=1))])
        until = np.full(len(self.pairs), -1.0)
        least = np.full(len(self.pairs), np.inf)
        needed = np.array([pair[2] for pair in self.pairs])
        for q, moved in zip(rows, most * way, strict=True):
            asked = np.flatnonzero(until <= moved)
            if len(asked):
                excess = self.distances(q, asked) - needed[asked]
                until[asked] = moved + excess
                least[asked] = np.minimum(least[asked], excess)
        return least


# Motions.


class Asked(NamedTuple):
    """What a tool has to keep to."""

    standoff: float
    tolerance: float
    cone: float  # rad
    roll: tuple[float, float] | None = None  # rad, the least and the largest; None where it is free
    # (3,) root frame, the axis at a roll of 0; None for where u grows.
    reference: Floats | None = None
    approach: Floats | None = None  # (3,) unit, all over the surface; None for along the normals


def evenly(rows: ArrayLike, per_segment: int = 20) -> Floats:
    """Rows (k, n) and others evenly on the straight lines between them."""
    rows = np.atleast_2d(np.asarray(rows, float))
    part = np.arange(per_segment)[:, None] / per_segment
    between = rows[:-1, None] * (1.0 - part) + rows[1:, None] * part
    return np.concatenate([between.reshape(-1, rows.shape[1]), rows[-1:]])


def closely(rows: ArrayLike, step: float) -> Floats:
    """Rows (k, n) and others between them, at most `step` (rad or m) apart in any joint."""
    rows = np.atleast_2d(np.asarray(rows, float))
    found = [rows[:1]]
    for a, b in pairwise(rows):
        count = max(1, int(np.ceil(np.abs(b - a).max() / step)))
        found.append(a + (np.arange(1, count + 1) / count)[:, None] * (b - a))
    return np.concatenate(found)


def roll_about(x: Floats, axes: Floats, references: Floats, approaches: Floats) -> Floats:
    """rad: x carried by the least rotation of axis to approach; its angle from the reference."""
    b = approaches
    t = unit(references - (references * b).sum(-1, keepdims=True) * b)
    hinge, cosine = np.cross(axes, b), (axes * b).sum(-1, keepdims=True)
    carried = (
        cosine * x
        + np.cross(hinge, x)
        + hinge * (hinge * x).sum(-1, keepdims=True) / (1.0 + cosine)
    )
    return np.arctan2((carried * np.cross(b, t)).sum(-1), (carried * t).sum(-1))


def roll_off(rolls: Floats, ends: tuple[float, float]) -> Floats:
    """rad, how far rolls are outside a range; at most 0 inside."""
    middle, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
    return np.abs((rolls - middle + np.pi) % TAU - np.pi) - half


class Kept(NamedTuple):
    """What a motion keeps at samples; arrays (k,)."""

    off: Floats  # m, of the tool point from its target
    tilt: Floats  # rad, of the axis from the approach
    roll: Floats  # rad beyond the range; -inf where it is free


def kept_over(arm: Arm, surface: Any, asked: Asked, q: Floats) -> Kept:
    """What each configuration q (k, n) keeps, over the place that suits it best."""
    points, axes, x = arm.tool(q)
    best = None
    for place in surface.over(points, asked.standoff):
        target = points - (place.points + surface.sign * asked.standoff * place.normals)
        approach = -surface.sign * place.normals
        if asked.approach is not None:
            approach = np.broadcast_to(asked.approach, approach.shape)
        roll = np.full(len(q), -np.inf)
        if asked.roll is not None:
            along = place.along if asked.reference is None else asked.reference
            along = np.broadcast_to(along, approach.shape)
            roll = roll_off(roll_about(x, axes, along, approach), asked.roll)
        here = Kept(np.linalg.norm(target, axis=1), angles_between(axes, approach), roll)
        used = np.maximum(here.off / asked.tolerance, here.tilt / max(asked.cone, SAME))
        if best is None:
            best, least = here, used
        else:
            nearer = used < least
            best = Kept(*(np.where(nearer, a, b) for a, b in zip(here, best, strict=True)))
            least = np.minimum(used, least)
    return best


def judge(
    arm: Arm,
    surface: Any,
    asked: Asked,
    q: ArrayLike,
    targets: tuple[Floats, Floats],
    marks: ArrayLike | None = None,
    scene: Scene | None = None,
    per_segment: int = 20,
    step: float = 0.02,
) -> list[str]:
    """What a motion q (m, n), straight between its rows, does wrong; nothing where it holds."""
    q, found = np.atleast_2d(np.asarray(q, float)), []
    if not np.isfinite(q).all():
        return ["limits: not finite"]
    outside = np.maximum(arm.limits[:, 0] - q, q - arm.limits[:, 1])
    if outside.max() > 0.0:
        found.append(f"limits: {arm.names[outside.max(axis=0).argmax()]} by {outside.max():.3g}")
    dense = evenly(q, per_segment)
    if surface is not None:
        kept = kept_over(arm, surface, asked, dense)
        most = zip(
            ("tolerance", "cone", "roll"), kept, (asked.tolerance, asked.cone, 0.0), strict=True
        )
        for name, values, allowed in most:
            if values.max() > allowed + SAME:
                row = values.argmax() / per_segment
                found.append(f"{name}: {values.max():.6g} of {allowed:.6g} at row {row:.1f}")
    points, axes, _ = arm.tool(q if marks is not None else dense)
    aims, approaches = targets
    if marks is None:
        near = np.linalg.norm(points[:, None] - aims, axis=2) <= asked.tolerance + SAME
        tilt = angles_between(axes[:, None], approaches[None])
        reached = (near & (tilt <= asked.cone + SAME)).any(axis=0)
    else:
        marks = np.asarray(marks)
        rows = np.flatnonzero(marks >= 0)
        cell = marks[rows]
        off = np.linalg.norm(points[rows] - aims[cell], axis=1)
        tilt = angles_between(axes[rows], approaches[cell])
        right = (off <= asked.tolerance + SAME) & (tilt <= asked.cone + SAME)
        if not right.all():
            found.append(f"marks: row {rows[~right][0]} is not over cell {cell[~right][0]}")
        reached = np.isin(np.arange(len(aims)), cell[right])
    if not reached.all():
        found.append(f"coverage: {np.flatnonzero(~reached)[:5].tolist()} of {len(aims)} are missed")
    if scene is not None and scene.pairs:
        excess = scene.least_excess(closely(q, step))
        k = int(excess.argmin())
        if excess[k] < -1e-6:
            found.append(
                f"clearance: {scene.pairs[k][0]} and {scene.pairs[k][1]} by {-excess[k]:.3g}"
            )
    return found
