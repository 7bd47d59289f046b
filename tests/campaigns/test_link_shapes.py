"""The shapes of every arm of the library: hulls and pieces hold them, and collide where they do.

`tests/robots/shapes` asks some of this of a few arms.
"""

from __future__ import annotations

from itertools import combinations

import coal
import numpy as np
import pinocchio as pin
import pytest
from hulls_of_arms import assert_held

from robots import Kinematics, Robot, list_robots, load_robot
from robots.shapes import LinkShapes, Solid, Triangles, link_pairs, link_shapes
from robots.shapes.sampling import PairSampling, random_configurations
from robots.urdf import Box, Cylinder, Sphere

NAMES = [info.name for info in list_robots()]
EXACT = ("ur5", "panda", "kinova", "xarm7", "puma560")


@pytest.mark.parametrize("name", NAMES)
def test_every_arm_has_shapes_and_its_hulls_and_pieces_hold_them(name: str) -> None:
    robot = load_robot(name)
    for fineness in ("hulls", "pieces"):
        shapes = link_shapes(robot, fineness)  # type: ignore[arg-type]
        assert_held(shapes)
        assert max(len(body.vertices) for body in shapes.polytopes) <= 64
        pairs = link_pairs(robot, shapes)
        print(
            f"{name} {fineness}: {len(shapes.polytopes)} bodies, {len(pairs.asked)} pairs, "
            f"unchecked {shapes.unchecked}, {pairs.notes}"
        )
        joints = {body.joint for body in shapes.polytopes}
        assert len(joints) > robot.n // 2
        assert pairs.asked


@pytest.mark.parametrize("name", EXACT)
def test_bodies_collide_wherever_the_exact_shapes_do(name: str) -> None:
    robot = load_robot(name)
    hulls, pieces = link_shapes(robot), link_shapes(robot, "pieces")
    joint = {body.owner: body.joint for body in hulls.polytopes}
    pairs = [(a, b) for a, b in combinations(joint, 2) if joint[a] != joint[b]]
    q = random_configurations(robot)[:300]
    exact = _exact(robot, hulls, pairs, q)
    for shapes in (hulls, pieces):
        found = PairSampling(robot, shapes.polytopes).collisions(pairs, q)
        assert not (exact & ~found).any()
    print(f"{name}: {exact.sum()} collisions of exact shapes, {found.sum()} of pieces")


def _exact(
    robot: Robot, shapes: LinkShapes, pairs: list[tuple[str, str]], q: np.ndarray
) -> np.ndarray:
    """(k, p) which pairs of exact shapes collide, one call of coal each."""
    bodies = [(solid, _coal(solid)) for solid in shapes.solids]
    model, data, kinematics = robot.model, robot.model.createData(), Kinematics(robot)
    found = np.zeros((len(q), len(pairs)), dtype=bool)
    for row, configuration in enumerate(q):
        pin.forwardKinematics(model, data, kinematics.configuration(configuration))
        poses = []
        for solid, _ in bodies:
            pose = data.oMi[solid.joint] * pin.SE3(np.array(solid.placement))
            poses.append(coal.Transform3s(pose.rotation, pose.translation))
        for column, (a, b) in enumerate(pairs):
            for i, j in combinations(range(len(bodies)), 2):
                if {bodies[i][0].owner, bodies[j][0].owner} == {a, b} and not found[row, column]:
                    result = coal.CollisionResult()
                    shape, other = bodies[i][1], bodies[j][1]
                    coal.collide(shape, poses[i], other, poses[j], coal.CollisionRequest(), result)
                    found[row, column] |= result.isCollision()
    return found


def _coal(solid: Solid) -> coal.CollisionGeometry:
    match solid.geometry:
        case Triangles(vertices, faces):
            mesh = coal.BVHModelOBBRSS()
            points, corners = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
            points.extend(list(np.array(vertices)))
            corners.extend([coal.Triangle(*map(int, face)) for face in faces])
            mesh.beginModel(len(faces), len(vertices))
            mesh.addSubModel(points, corners)
            mesh.endModel()
            return mesh
        case Box(size):
            return coal.Box(*size)
        case Sphere(radius):
            return coal.Sphere(radius)
        case Cylinder(radius, length):
            return coal.Cylinder(radius, length)
    raise AssertionError(solid.geometry)
