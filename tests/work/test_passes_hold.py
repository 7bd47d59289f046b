"""Motions along passes over random surfaces, before a referee with nothing of the product."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import plain
import pytest
from mesh_patches import Mesh, flat_faces, used
from plain import tools
from referee import Facets, Form, angles_between, on_triangles
from samples import EVERYTHING, sampled
from scipy.spatial.transform import Rotation

import coverable
from coverable import Task, parallel_passes, plan_passes, plane, sphere, torus, trajectory, verify
from surfaces.meshes.triangle_mesh import TriangleMesh

ARMS = {"ur5": 0.5, "ur10": 0.7, "panda": 0.5, "puma560": 0.6}  # and m, where the surfaces stand
KINDS = ("plane", "cylinder", "sphere", "cone", "torus", "hyperboloid", "bumps", "bumps with hole")
MAKERS = {"cylinder": coverable.cylinder, "sphere": sphere, "cone": coverable.cone, "torus": torus,
          "hyperboloid": coverable.hyperboloid}  # fmt: skip
PLACES = 12  # of each segment that are looked at
ROUNDING = 1e-6  # [m], [rad]
BLENDED = math.radians(2.0)  # how far normals of triangles may be from otherwise blended ones


@dataclass(frozen=True, eq=False)
class Drawn:
    arm: str
    surface: Any
    task: Task
    direction: float
    pitch: float
    overrun: float
    one_way: bool

    @cached_property
    def form(self) -> Form | Facets:
        """The surface as a formula of the referee, or as its triangles, with their border."""
        form = plain.surface_of(self.surface)
        if isinstance(form, Facets):
            faces = self.surface.mesh.faces
            sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
            each, count = np.unique(sides, axis=0, return_counts=True)
            placed = self.surface.mesh.vertices @ self.surface.rotation.T + self.surface.position
            form.border = placed[each[count == 1]]
        return form

    @cached_property
    def planned(self) -> coverable.PlannedPasses:
        laid = parallel_passes(
            self.surface, self.pitch, self.direction, overrun=self.overrun, one_way=self.one_way
        )
        return plan_passes(coverable.load_robot(self.arm), laid, self.task, retract=0.03)


def drawn(number):
    rng = np.random.default_rng([28, number])
    arm = tuple(ARMS)[number // len(KINDS) % len(ARMS)]
    surface = surface_of(KINDS[number % len(KINDS)], rng, ARMS[arm])
    task = Task(
        standoff=float(rng.choice([0.0, 0.005, 0.03])), cone_deg=float(rng.uniform(12.0, 30.0)),
        tolerance=float(rng.choice([5e-4, 1e-3])), footprint=0.05,
    )  # fmt: skip
    return Drawn(
        arm, surface, task,
        direction=float(rng.choice([0.0, math.pi / 2, rng.uniform(0.0, math.pi)])),
        pitch=float(rng.uniform(0.03, 0.08)), overrun=float(rng.choice([0.0, 0.0, 0.01])),
        one_way=bool(rng.random() < 0.2),
    )  # fmt: skip


def surface_of(kind, rng, far):
    """A surface of some 0.2 m in front of the arm, tilted by up to 20 degrees.

    Those of revolution lie, so that what looks up is worked on.
    """
    tilt = Rotation.from_euler("xyz", rng.uniform(-20, 20, 3), degrees=True)
    at = np.array([far, rng.uniform(-0.1, 0.1), rng.uniform(0.0, 0.2)])
    wide, deep = rng.uniform(0.1, 0.2, 2)
    pose = at, tilt.as_euler("xyz", degrees=True)
    if kind.startswith("bumps"):
        return bumps(rng, wide, deep, pose, kind.endswith("hole"))
    if kind == "plane":
        return plane((-wide / 2, wide / 2), (-deep / 2, deep / 2), "outside", *pose)
    radius = float(rng.uniform(0.12, 0.4))
    half = math.degrees(wide / radius / 2)
    lying = tilt * Rotation.from_euler("x", 90, degrees=True)
    u, v, size, low = (90 - half, 90 + half), (-deep / 2, deep / 2), (radius,), radius
    match kind:
        case "sphere":
            lying = tilt * Rotation.from_euler("y", -90, degrees=True)
            v = tuple(np.degrees([-deep / radius / 2, deep / radius / 2]))
        case "torus":
            tube = 0.8 * radius
            v = tuple(np.degrees([-deep / tube / 2, deep / tube / 2]))
            size, low = (radius, tube), radius + tube
        case "cone":
            size = (radius, float(rng.uniform(-0.3, 0.3)))
        case "hyperboloid":
            size = (radius, float(rng.uniform(0.15, 0.4)))
    below = tilt.apply([0, 0, -low]) + at
    return MAKERS[kind](*size, u, v, "outside", below, lying.as_euler("xyz", degrees=True))


def bumps(rng, wide, deep, pose, hole):
    """Irregular triangles with waves some millimetres high."""
    x, y = np.meshgrid(np.linspace(0, wide, 25), np.linspace(0, deep, 25))
    points = np.column_stack([x.ravel(), y.ravel()])
    inner = ((points > 0) & (points < [wide, deep])).all(axis=1)
    points[inner] += rng.uniform(-0.001, 0.001, (int(inner.sum()), 2))
    faces = flat_faces(points, 0.0)
    if hole:
        middle = points[faces].mean(axis=1)
        faces = faces[np.linalg.norm(middle - [wide / 2, deep / 2], axis=1) > 0.03]
    waves = rng.uniform(-0.002, 0.002, 2)
    z = waves[0] * np.sin(20 * points[:, 0]) + waves[1] * np.cos(15 * points[:, 1])
    own = used(Mesh(np.column_stack([points - [wide / 2, deep / 2], z]), faces))
    return coverable.mesh(TriangleMesh(*own), side="outside", position=pose[0], rpy_deg=pose[1])


def nearest(form, points):
    """Places of a surface, with its normals, and which of them lie on its border."""
    where = form.nearest(points)
    places = form.at(*where)
    if isinstance(form, Form):
        return places.points, places.normals, np.isin(where[0], form.u) | np.isin(where[1], form.v)
    row, edge = np.divmod(np.arange(len(points) * len(form.border)), len(form.border))
    away = on_triangles(places.points[row], form.border[edge][:, [0, 1, 1]])[1]
    return places.points, places.normals, away.reshape(len(points), -1).min(axis=1) < 1e-7


def worst(case, q, cell):
    """How far a motion with marked rows leaves what it has to keep, sampled between its rows.

    rad or m beyond a limit; m beyond the tolerance and rad beyond the cone where the tool works; m
    below the surface where it is lifted or beyond the border. All are at most 0 where it is right.
    """
    along, task = case.planned, case.task
    robot, on = along.verdict.robot, along.places.on_surface
    limit = max(float((robot.lower - q).max()), float((q - robot.upper).max()))
    marks = np.flatnonzero(cell >= 0)
    share = np.linspace(0.0, 1.0, PLACES, endpoint=False)[:, None, None]
    dense = (q[None, :-1] + share * np.diff(q, axis=0)).transpose(1, 0, 2).reshape(-1, robot.n)
    row = np.repeat(np.arange(len(q) - 1), PLACES)
    before = marks[np.clip(np.searchsorted(marks, row, "right") - 1, 0, len(marks) - 2)]
    after = marks[np.clip(np.searchsorted(marks, row, "right"), 1, len(marks) - 1)]
    works = on[cell[before]] & on[cell[after]]
    faceted = isinstance(case.form, Facets)
    some = slice(None, None, 1 + len(dense) // 3000 if faceted else 1)
    dense, works = dense[some], works[some]
    points, axes = tools(robot, dense)
    feet, normals, border = nearest(case.form, points)
    heights = ((points - feet) * normals).sum(axis=1)
    if faceted:
        off = np.abs(np.linalg.norm(points - feet, axis=1) - task.standoff)
    else:
        off = np.linalg.norm(points - feet - task.standoff * normals, axis=1)
    angles = angles_between(axes, -normals) - (BLENDED if faceted else 0.0)
    deep = -heights[~works & ~border] - task.effective_tolerance
    beyond = float(off[works].max()) - task.effective_tolerance
    return limit, beyond, float((angles[works] - task.cone).max()), float(deep.max(initial=-1.0))


@pytest.fixture(scope="module")
def held():
    return {}


@sampled("number", range(200) if EVERYTHING else range(1, len(KINDS), 2))
def test_what_is_called_feasible_is_right_over_the_surface(number, held):
    """The motion and its trajectory; and one that comes down by three tolerances is refused."""
    case = drawn(number)
    held[number] = False
    try:
        along = case.planned
    except coverable.SurfaceError:  # the tool would have to be lifted further
        return
    robot, cells, task = along.verdict.robot, along.cells, along.verdict.task
    if not along.verdict.feasible:
        return
    held[number] = True
    run = trajectory(coverable.coverage_path(along.verdict), 0.2)
    for q, cell in ((along.verdict.witness.q, along.verdict.witness.cell), (run.q, run.cell)):
        found = verify(robot, cells, task, q, working=cells.surface.works(cell))
        assert found.holds, found.refusal
        assert max(worst(case, q, cell)) <= ROUNDING
    bent = q + 0.03 * np.sin(np.arange(len(q)) / 7.0)[:, None] * np.eye(robot.n)[1]
    assert max(worst(case, bent, cell)) > ROUNDING
    assert not verify(robot, cells, task, bent, working=cells.surface.works(cell)).holds


def test_most_have_a_motion(held):
    assert sum(held.values()) >= (0.9 if EVERYTHING else 0.6) * len(held)
