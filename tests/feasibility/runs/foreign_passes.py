"""Random passes on four arms, and a referee of motions along them that asks nothing of the product.

The tool is where Pinocchio says. The surfaces are formulas and triangles written here anew; the
nearest place is looked for on a fine grid, and by Newton's method from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.spatial import Delaunay, cKDTree
from scipy.spatial.transform import Rotation

from feasibility import Task
from feasibility.runs import PlannedPasses, plan_passes
from robots import load_robot
from surfaces import cone, cylinder, hyperboloid, mesh, plane, sphere, torus
from surfaces.meshes import TriangleMesh
from surfaces.passes import parallel_passes

ARMS = {"ur5": 0.5, "ur10": 0.7, "panda": 0.5, "puma560": 0.6}  # and m, where the surfaces stand
KINDS = ("plane", "cylinder", "sphere", "cone", "torus", "hyperboloid", "bumps", "bumps with hole")
PLACES = 12  # of each segment that are looked at
GRID = 240
ROUNDING = 1e-6  # [m], [rad]
COARSE = math.radians(6.0)  # how far plain normals of triangles are from blended ones

Formula = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Smooth:
    """A formula g(u, v) in its own frame, over a rectangle, with its outward normal g_u x g_v."""

    g: Formula
    u: tuple[float, float]
    v: tuple[float, float]
    turn: Rotation
    at: np.ndarray
    outward: float = 1.0

    def _jet(self, u: np.ndarray, v: np.ndarray) -> list[np.ndarray]:
        h = 1e-5
        return [
            self.g(u, v),
            (self.g(u + h, v) - self.g(u - h, v)) / (2 * h),
            (self.g(u, v + h) - self.g(u, v - h)) / (2 * h),
        ]

    @cached_property
    def _tree(self) -> tuple[cKDTree, np.ndarray, np.ndarray]:
        u, v = (
            x.ravel() for x in np.meshgrid(np.linspace(*self.u, GRID), np.linspace(*self.v, GRID))
        )
        return cKDTree(self.g(u, v)), u, v

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places (k, 3) m, outward unit normals, and whether they lie on the border."""
        local = self.turn.inv().apply(points - self.at)
        tree, us, vs = self._tree
        start = tree.query(local)[1]
        u, v = us[start], vs[start]
        for _ in range(12):
            here, by_u, by_v = self._jet(u, v)
            off = local - here
            a, b, c = ((x * y).sum(axis=1) for x, y in ((by_u, by_u), (by_u, by_v), (by_v, by_v)))
            p, q = (by_u * off).sum(axis=1), (by_v * off).sum(axis=1)
            free = np.ones((2, len(u)), dtype=bool)
            for _ in range(2):  # on the border only along it
                du = np.where(free[1], (c * p - b * q) / (a * c - b * b), p / a) * free[0]
                dv = np.where(free[0], (a * q - b * p) / (a * c - b * b), q / c) * free[1]
                free[0] &= (u + du >= self.u[0]) & (u + du <= self.u[1])
                free[1] &= (v + dv >= self.v[0]) & (v + dv <= self.v[1])
            u, v = np.clip(u + du, *self.u), np.clip(v + dv, *self.v)
        here, by_u, by_v = self._jet(u, v)
        normal = self.outward * np.cross(by_u, by_v)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        border = (np.isin(u, self.u)) | np.isin(v, self.v)
        return self.turn.apply(here) + self.at, self.turn.apply(normal), border


@dataclass(frozen=True, eq=False)
class Faceted:
    """Triangles (F, 3, 3) m."""

    corners: np.ndarray
    edges: np.ndarray
    """(b, 2, 3) m, of the border."""

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See `Smooth.nearest`; by brute force."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        places, normals = np.empty_like(points), np.empty_like(points)
        for k, p in enumerate(points):
            flat = p - ((p - a) * normal).sum(axis=1)[:, None] * normal
            inside = np.ones(len(a), dtype=bool)
            best, away = flat, np.full(len(a), np.inf)
            for start, end in ((a, b), (b, c), (c, a)):
                inside &= (np.cross(end - start, flat - start) * normal).sum(axis=1) >= 0.0
                on, apart = _on_lines(p, start, end)
                best = np.where((apart < away)[:, None], on, best)
                away = np.minimum(away, apart)
            found = np.where(inside[:, None], flat, best)
            face = int(np.linalg.norm(p - found, axis=1).argmin())
            places[k], normals[k] = found[face], normal[face]
        border = np.array(
            [_on_lines(p, *self.edges.swapaxes(0, 1))[1].min() < 1e-7 for p in places]
        )
        return places, normals, border


def _on_lines(p: np.ndarray, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The nearest places of pieces to a point, and how far they are."""
    way = end - start
    share = ((p - start) * way).sum(axis=1) / (way**2).sum(axis=1)
    on = start + np.clip(share, 0.0, 1.0)[:, None] * way
    return on, np.linalg.norm(p - on, axis=1)


@dataclass(frozen=True, eq=False)
class Drawn:
    """One random case."""

    arm: str
    surface: Any
    referee: Smooth | Faceted
    task: Task
    direction: float
    pitch: float
    overrun: float
    one_way: bool

    @cached_property
    def planned(self) -> PlannedPasses:
        """Passes, and the verdict on one motion along them."""
        laid = parallel_passes(
            self.surface, self.pitch, self.direction, overrun=self.overrun, one_way=self.one_way
        )
        return plan_passes(load_robot(self.arm), laid, self.task, retract=0.03)


@cache
def drawn(number: int) -> Drawn:
    """The case of a number."""
    rng = np.random.default_rng([28, number])
    arm = tuple(ARMS)[number // len(KINDS) % len(ARMS)]
    surface, referee = _surface(KINDS[number % len(KINDS)], rng, ARMS[arm])
    task = Task(
        standoff=float(rng.choice([0.0, 0.005, 0.03])),
        cone_deg=float(rng.uniform(12.0, 30.0)),
        tolerance=float(rng.choice([5e-4, 1e-3])),
        footprint=0.05,
    )
    return Drawn(
        arm, surface, referee, task,
        direction=float(rng.choice([0.0, math.pi / 2, rng.uniform(0.0, math.pi)])),
        pitch=float(rng.uniform(0.03, 0.08)),
        overrun=float(rng.choice([0.0, 0.0, 0.01])),
        one_way=bool(rng.random() < 0.2),
    )  # fmt: skip


def _surface(kind: str, rng: np.random.Generator, far: float) -> tuple[Any, Smooth | Faceted]:
    """A surface of some 0.2 m in front of the arm, tilted by up to 20 degrees; and the same here.

    Those of revolution lie, so that what looks up is worked on.
    """
    turn = Rotation.from_euler("xyz", rng.uniform(-20, 20, 3), degrees=True)
    at = np.array([far, rng.uniform(-0.1, 0.1), rng.uniform(0.0, 0.2)])
    wide, deep = rng.uniform(0.1, 0.2, 2)
    if kind == "plane":
        u, v = (-wide / 2, wide / 2), (-deep / 2, deep / 2)
        return plane(u, v, "outside", at, _rpy(turn)), Smooth(
            lambda u, v: np.stack([u, v, 0 * u], axis=-1), u, v, turn, at
        )
    if kind.startswith("bumps"):
        return _bumps(rng, wide, deep, turn, at, kind.endswith("hole"))
    radius = float(rng.uniform(0.12, 0.4))
    half = wide / radius / 2
    if kind == "sphere":
        tipped, below = (
            turn * Rotation.from_euler("y", -90, degrees=True),
            turn.apply([0, 0, -radius]) + at,
        )
        across = deep / radius / 2
        u, v = (math.pi / 2 - half, math.pi / 2 + half), (-across, across)
        made = sphere(radius, np.degrees(u), np.degrees(v), "outside", below, _rpy(tipped))
        return made, Smooth(
            lambda u, v: radius * _turned(np.sin(u), v, np.cos(u)), u, v, tipped, below
        )
    lying = turn * Rotation.from_euler("x", 90, degrees=True)
    u, v = (math.pi / 2 - half, math.pi / 2 + half), (-deep / 2, deep / 2)
    span = tuple(np.degrees(u))
    if kind == "torus":
        tube = 0.8 * radius
        v = (-deep / tube / 2, deep / tube / 2)
        below = turn.apply([0, 0, -radius - tube]) + at
        made = torus(radius, tube, span, tuple(np.degrees(v)), "outside", below, _rpy(lying))
        return made, Smooth(
            lambda u, v: _turned(radius + tube * np.cos(v), u, tube * np.sin(v)), u, v, lying, below
        )
    below = turn.apply([0, 0, -radius]) + at
    pose = ("outside", below, _rpy(lying))
    if kind == "cylinder":
        return cylinder(radius, span, v, *pose), Smooth(
            lambda u, v: _turned(radius + 0 * v, u, v), u, v, lying, below
        )
    if kind == "cone":
        slope = float(rng.uniform(-0.3, 0.3))
        return cone(radius, slope, span, v, *pose), Smooth(
            lambda u, v: _turned(radius + slope * v, u, v), u, v, lying, below
        )
    flare = float(rng.uniform(0.15, 0.4))
    return hyperboloid(radius, flare, span, v, *pose), Smooth(
        lambda u, v: _turned(radius * np.hypot(1.0, v / flare), u, v), u, v, lying, below
    )


def _turned(r: np.ndarray, u: np.ndarray, z: np.ndarray) -> np.ndarray:
    return np.stack([r * np.cos(u), r * np.sin(u), z], axis=-1)


def _rpy(turn: Rotation) -> np.ndarray:
    return turn.as_euler("xyz", degrees=True)


def _bumps(
    rng: np.random.Generator, wide: float, deep: float, turn: Rotation, at: np.ndarray, hole: bool
) -> tuple[Any, Faceted]:
    """Irregular triangles with waves some millimetres high."""
    x, y = np.meshgrid(np.linspace(0, wide, 25), np.linspace(0, deep, 25))
    points = np.column_stack([x.ravel(), y.ravel()])
    inner = ((points > 0) & (points < [wide, deep])).all(axis=1)
    points[inner] += rng.uniform(-0.001, 0.001, (int(inner.sum()), 2))
    faces = Delaunay(points).simplices
    if hole:
        middle = points[faces].mean(axis=1)
        faces = faces[np.linalg.norm(middle - [wide / 2, deep / 2], axis=1) > 0.03]
    waves = rng.uniform(-0.002, 0.002, 2)
    z = waves[0] * np.sin(20 * points[:, 0]) + waves[1] * np.cos(15 * points[:, 1])
    points = np.column_stack([points - [wide / 2, deep / 2], z])
    used, faces = np.unique(faces, return_inverse=True)
    made = TriangleMesh(points[used], faces.reshape(-1, 3))
    placed = turn.apply(np.array(made.vertices)) + at
    edges = np.sort(
        np.concatenate([made.faces[:, [0, 1]], made.faces[:, [1, 2]], made.faces[:, [2, 0]]])
    )
    each, count = np.unique(edges, axis=0, return_counts=True)
    surface = mesh(made, side="outside", position=at, rpy_deg=_rpy(turn))
    return surface, Faceted(placed[made.faces], placed[each[count == 1]])


def tools(robot: Any, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(m, 3) tool points and axes, by Pinocchio alone."""
    data = robot.model.createData()
    points, axes = [], []
    for row in q:
        full = pin.integrate(robot.model, pin.neutral(robot.model), np.ascontiguousarray(row))
        pin.forwardKinematics(robot.model, data, full)
        pin.updateFramePlacements(robot.model, data)
        placed = data.oMf[robot.tool_frame_id]
        points.append(placed.translation.copy())
        axes.append(placed.rotation @ robot.approach_axis)
    return np.array(points), np.array(axes)


def worst(case: Drawn, q: np.ndarray, cell: np.ndarray) -> tuple[float, float, float, float]:
    """How far a motion with marked rows leaves what it has to keep, sampled between its rows.

    Returns:
        rad or m beyond a limit; m beyond the tolerance and rad beyond the cone where the tool
        works; m below the surface where it is lifted or beyond the border. All are at most 0 where
        it is right.
    """
    along = case.planned
    robot, on = along.verdict.robot, along.places.on_surface
    limit = max(float((robot.lower - q).max()), float((q - robot.upper).max()))
    marks = np.flatnonzero(cell >= 0)
    share = np.linspace(0.0, 1.0, PLACES, endpoint=False)[:, None, None]
    dense = (q[None, :-1] + share * np.diff(q, axis=0)).transpose(1, 0, 2).reshape(-1, robot.n)
    row = np.repeat(np.arange(len(q) - 1), PLACES)
    before = marks[np.clip(np.searchsorted(marks, row, "right") - 1, 0, len(marks) - 2)]
    after = marks[np.clip(np.searchsorted(marks, row, "right"), 1, len(marks) - 1)]
    works = on[cell[before]] & on[cell[after]]
    points, axes = tools(robot, dense)
    if isinstance(case.referee, Faceted):  # brute force
        some = slice(None, None, 1 + len(points) // 3000)
        points, axes, works = points[some], axes[some], works[some]
    feet, normals, border = case.referee.nearest(points)
    heights = ((points - feet) * normals).sum(axis=1)
    if isinstance(case.referee, Smooth):
        off = np.linalg.norm(points - feet - case.task.standoff * normals, axis=1)
        angles = np.arccos(np.clip(-(axes * normals).sum(axis=1), -1.0, 1.0))
    else:
        off = np.abs(np.linalg.norm(points - feet, axis=1) - case.task.standoff)
        angles = np.arccos(np.clip(-(axes * normals).sum(axis=1), -1.0, 1.0)) - COARSE
    tilt = float((angles[works] - case.task.cone).max())
    deep = -heights[~works & ~border] - case.task.effective_tolerance
    return (
        limit,
        float(off[works].max()) - case.task.effective_tolerance,
        tilt,
        float(deep.max(initial=-1.0)),
    )
