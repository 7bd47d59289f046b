"""Witnesses over meshes, looked at again between their waypoints by a reader of its own.

Pinocchio places the tool; the closest points are those on the triangles as they were given, before
any repair, split or cut, found by trying every triangle that can be nearest. `surfaces` is not
used, nor the curves that the search and its replay follow.
"""

from __future__ import annotations

from typing import NamedTuple

import mesh_patches
import numpy as np
import pytest
from dense_replay import angles, dense, tools
from scipy.spatial import cKDTree

from feasibility import Task, check
from robots import load_robot
from surfaces import cylinder, rotation_from_rpy
from surfaces.meshes import TriangleMesh, mesh

PER_SEGMENT = 6
SETTLED = 1e-7  # m, how far the last iteration may move a closest point
ITERATIONS = 60  # of the search for a closest point


class ClosestPoints(NamedTuple):
    points: np.ndarray
    """(k, 3) m."""
    normals: np.ndarray
    """(k, 3) unit, interpolated between the vertices."""


class Reader:
    """Closest points on triangles, and normals weighted by the angles at each vertex."""

    def __init__(self, vertices, faces):
        self.corners = vertices[faces]
        a, b, c = self.corners.swapaxes(0, 1)
        across = np.cross(b - a, c - a)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        sums = np.zeros_like(vertices)
        for k in range(3):
            ahead, behind = (self.corners[:, (k + i) % 3] - self.corners[:, k] for i in (1, 2))
            np.add.at(sums, faces[:, k], angles(_unit(ahead), _unit(behind))[:, None] * across)
        self.normals = _unit(sums)[faces]
        middles = self.corners.mean(axis=1)
        radii = np.linalg.norm(self.corners - middles[:, None], axis=2).max(axis=1)
        # Large triangles apart from small ones, so that few are looked at.
        self.sizes = [
            (some, cKDTree(middles[some]), radii[some].max())
            for some in np.array_split(np.argsort(radii), 5)
        ]
        self.vertices = cKDTree(vertices[np.unique(faces)])

    def nearest(self, points):
        """The closest of all points to `points` (k, 3)."""
        most = self.vertices.query(points)[0] + 1e-12
        rows, faces = [], []
        for some, tree, radius in self.sizes:
            # A triangle with its middle farther off than this cannot hold the closest point.
            found = tree.query_ball_point(points, most + radius)
            rows.append(np.repeat(np.arange(len(points)), [len(f) for f in found]))
            faces.append(some[np.concatenate(found).astype(np.int64)])
        row, face = np.concatenate(rows), np.concatenate(faces)
        weights, away = _on_triangles(points[row], self.corners[face])
        order = np.lexsort((away, row))
        first = order[np.searchsorted(row[order], np.arange(len(points)))]
        weights, face = weights[first], face[first]
        return ClosestPoints(
            np.einsum("kc,kci->ki", weights, self.corners[face]),
            _unit(np.einsum("kc,kci->ki", weights, self.normals[face])),
        )

    def closest_points(self, points, height):
        """Where x + height n(x) comes nearest to `points`, by iteration.

        The distance left over bounds that to the target surface from above, wherever this ends.
        """
        closest = self.nearest(points)
        moving = np.arange(len(points))
        for _ in range(ITERATIONS):
            again = self.nearest(points[moving] - height * closest.normals[moving])
            step = np.linalg.norm(again.points - closest.points[moving], axis=1)
            closest.points[moving], closest.normals[moving] = again
            moving = moving[step > SETTLED]
            if len(moving) == 0:
                break
        return closest


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _on_triangles(points, corners):
    """Weights (k, 3) of each triangle's closest point to its point, and their distance."""
    a, b, c = corners.swapaxes(0, 1)
    across = np.cross(b - a, c - a)
    square = np.einsum("ki,ki->k", across, across)
    second = np.einsum("ki,ki->k", np.cross(points - a, c - a), across) / square
    third = np.einsum("ki,ki->k", np.cross(b - a, points - a), across) / square
    best = np.column_stack([1.0 - second - third, second, third])
    away = np.linalg.norm(np.einsum("kc,kci->ki", best, corners) - points, axis=1)
    away[(best < 0.0).any(axis=1)] = np.inf
    for i, j in ((0, 1), (1, 2), (2, 0)):
        start, side = corners[:, i], corners[:, j] - corners[:, i]
        t = np.einsum("ki,ki->k", points - start, side) / np.einsum("ki,ki->k", side, side)
        t = np.clip(t, 0.0, 1.0)
        off = np.linalg.norm(start + t[:, None] * side - points, axis=1)
        nearer = off < away
        best[nearer] = 0.0
        best[nearer, i], best[nearer, j] = 1.0 - t[nearer], t[nearer]
        away = np.minimum(away, off)
    return best, away


def assert_held(verdict, vertices, faces):
    """Tolerance, cone, limits and cells, over the triangles (in the own frame) as given."""
    walk, robot, task, cells = verdict.witness, verdict.robot, verdict.task, verdict.cells
    surface = cells.surface
    tolerance = 1e-3 if task.tolerance is None else task.tolerance
    q = dense(walk.q, PER_SEGMENT)
    assert (q >= robot.lower - 1e-12).all()
    assert (q <= robot.upper + 1e-12).all()
    tips, axes = tools(robot, q)
    tips, axes = (tips - surface.position) @ surface.rotation, axes @ surface.rotation
    sign = surface.side_sign
    closest = Reader(vertices, faces).closest_points(tips, sign * task.standoff)
    targets = closest.points + sign * task.standoff * closest.normals
    assert np.linalg.norm(tips - targets, axis=1).max() <= tolerance
    assert angles(axes, -sign * closest.normals).max() <= task.cone + 1e-6
    marked = walk.cell >= 0
    assert set(walk.cell[marked].tolist()) == set(range(len(cells)))
    aims = task.targets(cells).points[walk.cell[marked]]
    centres = (aims - surface.position) @ surface.rotation
    assert np.linalg.norm(tips[::PER_SEGMENT][marked] - centres, axis=1).max() <= tolerance


def outward(made, scale=1.0, shift=(0.0, 0.0, 0.0)):
    """Vertices and faces, most of which look up."""
    vertices = scale * (made.vertices - np.asarray(shift))
    a, b, c = vertices[made.faces].swapaxes(0, 1)
    down = np.cross(b - a, c - a)[:, 2].sum() < 0.0
    return vertices, made.faces[:, ::-1] if down else made.faces


def cap():
    """The top of a ball of 300 mm."""

    def shape(u, v):
        polar, azimuth = 0.05 + 1.2 * u, 6.0 * v
        s = 0.3 * np.sin(polar)
        return s * np.cos(azimuth), s * np.sin(azimuth), 0.3 * np.cos(polar)

    return mesh_patches.bent(shape, 40, 80)


def scan(made, noise):
    """With noise on every vertex (m)."""
    rng = np.random.default_rng(0)
    return mesh_patches.Mesh(made.vertices + rng.normal(0, noise, made.vertices.shape), made.faces)


PARTS = {
    "fine hood": (outward(mesh_patches.hood(120, 100), 0.5), (0.45, 0.0, 0.1)),
    "coarse hood": (outward(mesh_patches.hood(16, 14), 0.5), (0.45, 0.0, 0.1)),
    "irregular": (outward(mesh_patches.scattered(), 0.5, (0.5, 0.4, 0.0)), (0.45, 0.0, 0.2)),
    "noisy plate": (
        outward(scan(mesh_patches.sheet(60), 3e-4), 0.7, (0.3, 0.2, 0.0)),
        (0.45, 0.0, 0.2),
    ),
    "noisy cap": (outward(scan(cap(), 1e-4)), (0.45, 0.0, -0.1)),
    "slivers": (
        (mesh_patches.slivers().vertices * [0.5, 0.5, 0.4], mesh_patches.slivers().faces),
        (0.5, 0.0, 0.1),
    ),
}
TASKS = {
    "near": Task(standoff=0.01, cone_deg=60),
    "touching, wide": Task(standoff=0.0, cone_deg=179),
}


SOME = [
    ("ur5", "coarse hood", "near"),
    ("ur5", "slivers", "near"),
    ("puma560", "noisy cap", "near"),
    ("ur5", "irregular", "touching, wide"),
]
MORE = [  # make campaign NAME=larger_samples
    ("ur5", "irregular", "near"),
    ("ur5", "noisy plate", "near"),
    ("ur5", "noisy cap", "near"),
    ("ur5", "noisy plate", "touching, wide"),
]


@pytest.mark.parametrize(("robot", "name", "task"), SOME)
def test_a_witness_holds_over_the_triangles_as_given(robot, name, task):
    (vertices, faces), position = PARTS[name]
    surface = mesh(TriangleMesh(vertices, faces), side="outside", position=position)
    verdict = check(load_robot(robot), surface.cells(60), TASKS[task])
    assert verdict.feasible
    assert_held(verdict, vertices, faces)


@pytest.mark.parametrize("robot", ["ur5", "panda"])
def test_a_witness_holds_over_a_hood_in_a_narrower_cone(robot):
    (vertices, faces), position = PARTS["fine hood"]
    surface = mesh(TriangleMesh(vertices, faces), side="outside", position=position)
    verdict = check(load_robot(robot), surface.cells(60), Task(standoff=0.03, cone_deg=25))
    assert verdict.feasible
    assert_held(verdict, vertices, faces)


THIN = [
    ("ur5", 0.0108, 0.194, (10, 70, 80), (0.37, -0.32, 0.18), "outside", 0.0, 2.0),
    ("panda", 0.0127, 0.318, (-40, 130, 70), (0.44, -0.06, 0.25), "inside", 0.003, 0.5),
]


@pytest.mark.parametrize("case", THIN)
def test_the_cone_holds_along_a_thin_rod_where_the_tool_point_is(case):
    """A rod curves across the motion only; a tool point to its side has another normal."""
    name, radius, length, rpy, position, side, standoff, cone = case
    rod = cylinder(radius, (-10, 10), (0.0, length), side=side, rpy_deg=rpy, position=position)
    verdict = check(load_robot(name), rod.cells(1, 3), Task(standoff=standoff, cone_deg=cone))
    if verdict.feasible:
        tips, axes = tools(verdict.robot, dense(verdict.witness.q, PER_SEGMENT))
        turn = rotation_from_rpy(*np.radians(rpy))
        off = (tips - np.asarray(position)) @ turn
        off[:, 2] = 0.0
        approach = -rod.side_sign * _unit(off) @ turn.T
        assert angles(axes, approach).max() <= verdict.task.cone + 1e-9
    else:
        assert verdict.answer == "undecided"


def thorny_plate():
    """A plate with one thorn, thinner than its other triangles are long."""
    x, y = np.meshgrid(np.linspace(0, 0.4, 41), np.linspace(0, 0.3, 31))
    points = np.column_stack([x.ravel(), y.ravel()])
    tip, turns = np.array(THORN), np.arange(6) * np.pi / 3
    points = points[np.linalg.norm(points - tip, axis=1) > 2e-3]
    base = tip + 5e-4 * np.column_stack([np.cos(turns), np.sin(turns)])
    points = np.concatenate([points, base, tip[None]])
    vertices = np.column_stack([points, np.zeros(len(points))])
    vertices[-1, 2] = 0.015
    return vertices, mesh_patches.flat_faces(points, 1e-12)


THORN = (0.08069597657662232, 0.21995366749323075)


def test_no_motion_is_certified_through_a_thorn():
    """The tool point keeps its distance from everything, also from what is thin."""
    vertices, faces = thorny_plate()
    surface = mesh(TriangleMesh(vertices, faces), side="outside", position=(0.35, -0.15, 0.2))
    task = Task(standoff=0.01, cone_deg=40)
    verdict = check(load_robot("ur5"), surface.cells(150), task)
    if verdict.feasible:
        tips, _ = tools(verdict.robot, dense(verdict.witness.q, PER_SEGMENT))
        tips = tips - surface.position
        away = np.linalg.norm(tips - Reader(vertices, faces).nearest(tips).points, axis=1)
        assert away.min() >= 9e-3 - 1e-9
    else:
        assert verdict.answer == "undecided"
