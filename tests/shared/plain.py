"""The product's arms, surfaces, tasks and scenes as plain numbers, which the referee judges by."""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin
import referee
from numpy.typing import ArrayLike, NDArray
from referee import Arm, Asked, Facets, Floats, Form, Pieces, Scene, Shape

from coverable import Cells, Robot, Surface, Task, Verdict
from feasibility.collisions.asked_bodies import gather
from robots.shapes.bodies import HalfSpace, Triangles
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

NAMED = ("plane", "sphere", "cylinder", "cone", "torus", "hyperboloid", "ellipsoid")


@lru_cache(maxsize=64)
def arm_of(robot: Robot) -> Arm:
    """The arm out of its URDF file, with the limits, TCP and mounting of a robot."""
    assert robot.urdf is not None, "an arm without a file"
    axes = [
        {"name": one.name, "kind": one.kind, "axis": one.axis, "position": one.position,
         "rpy": np.radians(one.rpy_deg), "carries": one.carries}
        for one in robot.axes
    ]  # fmt: skip
    base = robot.base
    for one in axes:
        if one["carries"] == "base":
            base = np.linalg.inv(referee.placement(one["position"], one["rpy"])) @ base
    made = Arm(
        referee.joints_of(robot.urdf), robot.tool_frame, robot.joint_names, tcp=robot.tcp,
        approach=robot.approach_axis, reference=robot.reference_axis, base=base,
        locked=dict(robot.locked), seen_from=robot.surface_link,
        limits=np.column_stack([robot.lower, robot.upper]),
    )  # fmt: skip
    return made.carried(axes) if axes else made


def surface_of(surface: Surface) -> Any:
    """A `Form`, `Pieces` or `Facets`; None for poses, and for formulas that nobody knows here."""
    pose = {"position": surface.position, "rotation": surface.rotation}
    outside = surface.side == "outside"
    if surface.kind == "poses":
        return None
    if surface.kind == "piecewise":
        pieces = zip(surface.placed, surface.signs, strict=True)
        return Pieces([_piece(patch, sign, outside) for patch, sign in pieces])
    if hasattr(surface, "mesh"):
        corners = surface.mesh.vertices @ surface.rotation.T + surface.position
        return Facets(corners, surface.mesh.faces, outside)
    formula = None
    if surface.kind == "revolution":
        formula = referee.spline_curve(surface.profile.points)
    elif surface.kind == "bspline":
        net = surface.net
        formula = referee.spline_sheet(net.points, net.degree, net.knots, net.weights)
    elif surface.kind not in NAMED:
        return None
    return Form(
        surface.kind, surface.lengths, surface.u_range, surface.v_range, outside, **pose,
        formula=formula,
    )  # fmt: skip


def _piece(patch: Any, sign: float, outside: bool) -> Form:
    """A patch of several, whose normal may be turned over."""
    made = surface_of(patch)
    return replace(made, outside=outside if sign > 0 else not outside)


def at_home(form: Form) -> Form:
    """The same in its own frame."""
    return replace(form, position=np.zeros(3), rotation=np.eye(3))


def triangles_of_grid(points: Floats) -> Floats:
    """(F, 3, 3) of a grid of points (m, n, 3), looking along the cross product of its steps."""
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    halves = np.stack([np.stack([a, b, c], -2), np.stack([a, c, d], -2)], -3)
    return halves.reshape(-1, 3, 3)


def facets_of(form: Form, nu: int, nv: int) -> Floats:
    """(F, 3, 3) triangles with corners on a patch, looking where its normals do."""
    u, v = np.meshgrid(np.linspace(*form.u, nu + 1), np.linspace(*form.v, nv + 1), indexing="ij")
    places = form.at(u.ravel(), v.ravel())
    corners = triangles_of_grid(places.points.reshape(nu + 1, nv + 1, 3))
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = (facing * form.at(*form.nearest(corners.mean(axis=1))).normals).sum() > 0.0
    return corners if outward else corners[:, ::-1]


def asked_of(task: Task, cells: Cells) -> Asked:
    roll = task.roll_deg
    roll = None if roll is None or roll[1] - roll[0] >= 360.0 else tuple(np.radians(roll))
    turned, approach = cells.surface.rotation, task.approach
    fixed = approach is not None and not isinstance(approach, str)
    tolerance = 1e-3 if task.tolerance is None else task.tolerance
    return Asked(
        task.standoff, tolerance, np.radians(task.cone_deg),
        roll, None if task.roll_reference is None else turned @ np.array(task.roll_reference),
        referee.unit(turned @ np.array(approach)) if fixed else None,
    )  # fmt: skip


def targets_of(cells: Cells, task: Task) -> tuple[Floats, Floats]:
    """Points and approaches of all centres: by the formula where the cells are a grid."""
    form = surface_of(cells.surface)
    if isinstance(form, Form) and hasattr(cells, "shape"):
        places = form.centres(*cells.shape)
        points, normals, sign = places.points, places.normals, form.sign
    else:
        points, normals = cells.centres, cells.normals
        sign = 1.0 if cells.surface.side == "outside" else -1.0
    asked = asked_of(task, cells)
    approaches = -sign * normals
    if asked.approach is not None:
        approaches = np.broadcast_to(asked.approach, normals.shape)
    elif task.approach is None and cells.approaches is not None:
        approaches = cells.approaches
    return points + sign * task.standoff * normals, approaches


def geometry_of(shape: Any) -> tuple:
    match shape:
        case Box(size):
            return ("box", tuple(size))
        case Sphere(radius):
            return ("sphere", radius)
        case Capsule(radius, length):
            return ("capsule", radius, length)
        case Cylinder(radius, length):
            return ("cylinder", radius, length)
        case HalfSpace():
            return ("halfspace",)
        case Triangles(vertices, faces):
            return ("mesh", np.asarray(vertices)[np.asarray(faces)])
    raise TypeError(shape)


def scene_of(robot: Robot, cells: Cells, task: Task) -> Scene | None:
    """What a task keeps apart; links as the URDF has them, read by trimesh."""
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    if bodies is None:
        return None
    found = referee.link_bodies(robot.urdf, robot.package_dirs)
    for one in task.collision.scene:
        at = np.asarray(one.placement)
        found[one.name] = [Shape(one.frame, at, geometry_of(one.geometry))]
    for shape in task.collision.tool:
        made = Shape(robot.tool_frame, np.asarray(shape.placement), geometry_of(shape.geometry))
        found.setdefault("tool", []).append(made)
    pairs = [(pair.first, pair.second, pair.clearance) for pair in bodies.pairs]
    if any("surface" in pair for pair in pairs):
        found["surface"] = sheet_of(cells.surface)
    return Scene(arm_of(robot), found, pairs)


def sheet_of(surface: Surface) -> list[Shape]:
    """The surface as triangles, and how far it may stand out between their corners."""
    form, made = surface_of(surface), []
    if isinstance(form, Facets):
        return [Shape(None, np.eye(4), ("mesh", form.corners))]
    for one in form.pieces if isinstance(form, Pieces) else [form]:
        corners = facets_of(one, 50, 50)
        middles = corners.mean(axis=1)
        off = np.linalg.norm(one.at(*one.nearest(middles)).points - middles, axis=1).max()
        made.append(Shape(None, np.eye(4), ("mesh", corners), 1.5 * float(off)))
    return made


def faults_of(
    verdict: Verdict,
    q: ArrayLike | None = None,
    marks: ArrayLike | None = None,
    surface: Any = None,
    **more: Any,
) -> list[str]:
    """What the referee finds wrong with a verdict's motion, or with another for its question."""
    walk, cells, task = verdict.witness, verdict.cells, verdict.task
    if q is None:
        q, marks = walk.q, walk.cell
    surface = surface_of(cells.surface) if surface is None else surface
    return referee.judge(
        arm_of(verdict.robot), surface, asked_of(task, cells), q, targets_of(cells, task), marks,
        **more,
    )  # fmt: skip


def assert_motion(verdict: Verdict, q: Floats) -> None:
    """The straight segments between rows (m, n) keep tolerance, cone, limits and patch."""
    arm, asked = arm_of(verdict.robot), asked_of(verdict.task, verdict.cells)
    nothing = np.empty((0, 3)), np.empty((0, 3))
    assert referee.judge(arm, surface_of(verdict.cells.surface), asked, q, nothing) == []


def assert_over(verdict: Verdict, cell: NDArray[np.int64], q: Floats) -> None:
    """Every q (k, n) holds the tool over the centre of its cell, inside all constraints."""
    arm, asked = arm_of(verdict.robot), asked_of(verdict.task, verdict.cells)
    aims, approaches = targets_of(verdict.cells, verdict.task)
    points, axes, _ = arm.tool(q)
    assert (np.linalg.norm(points - aims[cell], axis=1) <= asked.tolerance).all()
    assert (referee.angles_between(axes, approaches[cell]) <= asked.cone + referee.SAME).all()
    assert ((q >= arm.limits[:, 0]) & (q <= arm.limits[:, 1])).all()


def tools(robot: Robot, q: Floats) -> tuple[Floats, Floats]:
    """Tool points and approach axes (k, 3) by Pinocchio: also of arms without a file."""
    model, data = robot.model, robot.model.createData()
    points, axes = np.empty((len(q), 3)), np.empty((len(q), 3))
    for k, row in enumerate(np.ascontiguousarray(q)):
        pin.forwardKinematics(model, data, pin.integrate(model, pin.neutral(model), row))
        placed = pin.updateFramePlacement(model, data, robot.tool_frame_id)
        points[k], axes[k] = placed.translation, placed.rotation @ robot.approach_axis
    return points, axes
