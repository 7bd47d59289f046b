"""Motions along passes over random surfaces on four arms, replayed by foreign code.

The replay is plain Pinocchio at twenty places of each segment, and the nearest place of all
triangles by brute force; neither asks anything of the product but the numbers of its answer.
"""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from feasibility import Task
from feasibility.paths import coverage_path
from feasibility.runs import PlannedPasses, plan_passes
from feasibility.timing import motion_limits, trajectory
from robots import load_robot
from surfaces import cone, cylinder, mesh, plane, sphere
from surfaces.meshes import TriangleMesh
from surfaces.passes import parallel_passes, working_mesh

ARMS = ("ur5", "ur10", "panda", "puma560")
FAR = {"ur5": 0.5, "ur10": 0.7, "panda": 0.5, "puma560": 0.6}  # m, where the surfaces stand
KINDS = ("bumps", "bumps", "plane", "cylinder", "sphere", "cone")
CASES = 40
ACCEPTED = 30
PLACES = 20
TOLERANCE, CONE_DEG, STANDOFF = 1e-3, 25.0, 0.03
SPEED = 0.2
TIMED = 4  # every so many are timed


def surface_of(kind: str, rng: np.random.Generator, far: float):
    """A surface of some 0.2 m, in front of the arm, tilted by up to 20 degrees."""
    turn = Rotation.from_euler("xyz", rng.uniform(-20, 20, 3), degrees=True)
    at = np.array([far, rng.uniform(-0.1, 0.1), rng.uniform(0.0, 0.2)])
    rpy = turn.as_euler("xyz", degrees=True)
    wide, deep = rng.uniform(0.1, 0.2, 2)
    if kind == "plane":
        return plane((-wide / 2, wide / 2), (-deep / 2, deep / 2), "outside", at, rpy)
    if kind == "bumps":
        return _bumps(rng, wide, deep, at, rpy)
    radius = float(rng.uniform(0.2, 0.4))
    half = math.degrees(wide / radius / 2)
    if kind == "sphere":
        below = at - turn.apply([0.0, 0.0, radius])
        across = math.degrees(deep / radius / 2)
        tipped = (turn * Rotation.from_euler("y", -90, degrees=True)).as_euler("xyz", degrees=True)
        return sphere(radius, (90 - half, 90 + half), (-across, across), "outside", below, tipped)
    # The axis lies; the line of u = 90 degrees looks up.
    below = at - turn.apply([0.0, 0.0, radius])
    lying = (turn * Rotation.from_euler("x", 90, degrees=True)).as_euler("xyz", degrees=True)
    span, height = (90 - half, 90 + half), (-deep / 2, deep / 2)
    if kind == "cylinder":
        return cylinder(radius, span, height, "outside", below, lying)
    return cone(radius, float(rng.uniform(-0.3, 0.3)), span, height, "outside", below, lying)


def _bumps(rng: np.random.Generator, wide: float, deep: float, at, rpy):
    """Irregular triangles with waves some millimetres high, every other one with a hole."""
    x, y = np.meshgrid(np.linspace(0, wide, 25), np.linspace(0, deep, 25))
    points = np.column_stack([x.ravel(), y.ravel()])
    inner = ((points > 0) & (points < [wide, deep])).all(axis=1)
    points[inner] += rng.uniform(-0.001, 0.001, (int(inner.sum()), 2))
    faces = Delaunay(points).simplices
    if rng.random() < 0.5:
        middle = points[faces].mean(axis=1)
        faces = faces[np.linalg.norm(middle - [wide / 2, deep / 2], axis=1) > 0.03]
    waves = rng.uniform(-0.002, 0.002, 2)
    z = waves[0] * np.sin(20 * points[:, 0]) + waves[1] * np.cos(15 * points[:, 1])
    points = np.column_stack([points - [wide / 2, deep / 2], z])
    used, faces = np.unique(faces, return_inverse=True)
    made = TriangleMesh(points[used], faces.reshape(-1, 3))
    return mesh(made, side="outside", position=at, rpy_deg=rpy)


@cache
def planned(number: int) -> PlannedPasses:
    """One random case: passes, and the verdict on one motion along them."""
    rng = np.random.default_rng([16, number])
    robot = load_robot(ARMS[number % len(ARMS)])
    surface = surface_of(KINDS[number % len(KINDS)], rng, FAR[robot.name])
    direction = float(rng.uniform(0.0, math.pi)) if number % 3 else (number // 3 % 2) * math.pi / 2
    overrun = (0.0, 0.01)[number % 2]
    laid = parallel_passes(surface, float(rng.uniform(0.03, 0.05)), direction, overrun=overrun)
    task = Task(STANDOFF, CONE_DEG, TOLERANCE, footprint=0.05)
    return plan_passes(robot, laid, task, retract=0.03)


def tool_of(robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


def nearest(points: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The nearest place of all triangles (F, 3, 3), and the normal there, by brute force."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    places, faces = np.empty_like(points), np.empty(len(points), dtype=int)
    for k, p in enumerate(points):
        flat = p - ((p - a) * normal).sum(axis=1)[:, None] * normal
        inside = np.ones(len(a), dtype=bool)
        best, away = flat, np.full(len(a), np.inf)
        for start, end in ((a, b), (b, c), (c, a)):
            way = end - start
            inside &= (np.cross(way, flat - start) * normal).sum(axis=1) >= 0.0
            share = ((p - start) * way).sum(axis=1) / (way**2).sum(axis=1)
            on = start + np.clip(share, 0.0, 1.0)[:, None] * way
            nearer = np.linalg.norm(p - on, axis=1)
            best = np.where((nearer < away)[:, None], on, best)
            away = np.minimum(away, nearer)
        found = np.where(inside[:, None], flat, best)
        faces[k] = int(np.linalg.norm(p - found, axis=1).argmin())
        places[k] = found[faces[k]]
    return places, normal[faces]


def from_lines(points: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """(m,) m from each point to the nearest of some pieces."""
    way = ends - starts
    squared = np.maximum((way**2).sum(axis=1), 1e-18)
    found = np.empty(len(points))
    for k, p in enumerate(points):
        share = np.clip(((p - starts) * way).sum(axis=1) / squared, 0.0, 1.0)
        found[k] = np.linalg.norm(p - starts - share[:, None] * way, axis=1).min()
    return found


def judge(along: PlannedPasses) -> None:
    """Replay one accepted motion."""
    robot, walk, places = along.verdict.robot, along.verdict.witness, along.places
    assert (walk.q >= robot.lower - 1e-12).all()
    assert (walk.q <= robot.upper + 1e-12).all()
    share = np.linspace(0.0, 1.0, PLACES, endpoint=False)[:, None, None]
    dense = walk.q[None, :-1] + share * np.diff(walk.q, axis=0)[None]
    dense = np.concatenate([dense.transpose(1, 0, 2).reshape(-1, robot.n), walk.q[-1:]])
    points, axes = tool_of(robot, dense)
    targets = places.points + STANDOFF * places.normals
    # All of it runs along the lines between targets, in their order.
    assert from_lines(points, targets[:-1], targets[1:]).max() <= TOLERANCE + 1e-4
    visits = walk.cell[walk.cell >= 0]
    assert np.array_equal(np.unique(visits), np.arange(len(targets)))
    assert all(b - a in (0, 1) for a, b in pairwise(visits.tolist()))
    # Over the surface it keeps distance and direction; not where it is lifted, or off the border.
    edge = along.passes.spacing / 12.0
    corners = working_mesh(along.passes.surface, edge).corners
    feet, normals = nearest(points[::4], corners)
    heights = ((points[::4] - feet) * normals).sum(axis=1)
    sideways = np.linalg.norm(points[::4] - feet - heights[:, None] * normals, axis=1)
    over = (sideways < 0.1 * STANDOFF) & (heights < STANDOFF + 3e-3)
    assert over.mean() > 0.5
    assert np.abs(heights[over] - STANDOFF).max() <= TOLERANCE + 1.5e-3  # and the chords' sag
    angles = np.degrees(np.arccos(np.clip(-(axes[::4] * normals).sum(axis=1), -1.0, 1.0)))
    assert angles[over].max() <= CONE_DEG + 6.0  # plain normals of triangles, not blended ones
    treated = along.treated(walk)
    assert 0.5 < treated.lower <= treated.upper <= 1.0


def judge_timing(along: PlannedPasses) -> None:
    """Speeds of joints and tool between samples, by differences."""
    robot = along.verdict.robot
    run = trajectory(coverage_path(along.verdict), SPEED)
    limits = motion_limits(robot, SPEED)
    assert np.diff(run.time).min() > 0.0
    rates = np.abs(np.diff(run.q, axis=0)) / np.diff(run.time)[:, None]
    assert (rates <= limits.velocity * (1.0 + 1e-6)).all()
    points, _ = tool_of(robot, run.q)
    speeds = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(run.time)
    assert speeds.max() <= SPEED * (1.0 + 1e-3)


@pytest.mark.parametrize("number", range(CASES))
def test_an_accepted_motion_passes_a_foreign_replay(number: int) -> None:
    along = planned(number)
    print(number, along.verdict.robot.name, along.passes.surface.kind, along.verdict.answer)
    if along.verdict.feasible:
        judge(along)
        if number % TIMED == 0:
            judge_timing(along)


def test_most_are_accepted() -> None:
    accepted = [number for number in range(CASES) if planned(number).verdict.feasible]
    print(f"{len(accepted)} of {CASES} accepted")
    assert len(accepted) >= ACCEPTED
