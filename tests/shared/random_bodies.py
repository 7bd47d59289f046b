"""Bodies of made-up shapes on real and made-up arms, and what coal says of them."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from feasibility.collisions import Bodies, Pair, Soup
from robots import Robot
from robots.shapes import Polytope

Array = NDArray[np.float64]


def serial_arm(rng: np.random.Generator, kinds: str, length: float = 0.3) -> Robot:
    """A chain of joints, R or P, with axes and placements made up."""
    model = pin.Model()
    for index, kind in enumerate(kinds):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        joint = (
            pin.JointModelRevoluteUnaligned(axis)
            if kind == "R"
            else pin.JointModelPrismaticUnaligned(axis)
        )
        placement = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3) * length)
        model.addJoint(index, joint, placement, f"joint{index + 1}")
    n = len(kinds)
    model.addFrame(pin.Frame("tip", n, pin.SE3(np.eye(3), np.zeros(3)), pin.FrameType.BODY))
    return Robot(
        name="made up",
        model=model,
        tool_frame="tip",
        approach_axis=np.array([0.0, 0.0, 1.0]),
        joint_names=tuple(f"joint{i + 1}" for i in range(n)),
        joint_kinds=tuple("revolute" if kind == "R" else "prismatic" for kind in kinds),
        lower=np.full(n, -3.0),
        upper=np.full(n, 3.0),
    )


def hulls(rng: np.random.Generator, n: int, size: float = 0.08, at: float = 0.15) -> list[Polytope]:
    """One to three clouds of vertices around each joint, the root included: owners b0 to bn."""
    bodies = []
    for joint in range(n + 1):
        for _ in range(int(rng.integers(1, 4))):
            count = int(rng.integers(4, 30))
            cloud = rng.normal(size=(count, 3)) * size * rng.uniform(0.2, 1.0, 3)
            cloud += rng.normal(size=3) * at
            bodies.append(Polytope(f"b{joint}", joint, cloud, float(rng.choice([0.0, 0.02]))))
    return bodies


def all_pairs(owners: int, clearance: float) -> tuple[Pair, ...]:
    """Every pair of b0 to b(owners - 1) that is not adjacent."""
    return tuple(
        Pair(f"b{k}", f"b{i}", clearance) for i in range(owners) for k in range(i + 2, owners)
    )


def of_polytopes(bodies: list[Polytope], pairs: tuple[Pair, ...], *soups: Soup) -> Bodies:
    """Bodies with nothing for the judge."""
    return Bodies((), tuple(bodies), soups, (), pairs)


class CoalScene:
    """The same polytopes and soups as coal sees them, placed by Pinocchio."""

    def __init__(self, robot: Robot, bodies: Bodies) -> None:
        """Build hulls and triangle trees."""
        self.robot, self.bodies = robot, bodies
        self.data = robot.model.createData()
        self.shapes: dict[str, list[tuple[int, coal.CollisionGeometry, float]]] = {}
        for body in bodies.polytopes:
            shape = (body.joint, _convex(body.vertices), body.radius)
            self.shapes.setdefault(body.owner, []).append(shape)
        for soup in bodies.soups:
            self.shapes.setdefault(soup.owner, []).append((0, _tree(soup.triangles), 0.0))

    def distances(self, q: Array) -> Array:
        """(P,) m, of all pairs at q; of hulls negative where they overlap."""
        pin.forwardKinematics(self.robot.model, self.data, q)
        return np.array([self._distance(p.first, p.second) for p in self.bodies.pairs])

    def _distance(self, first: str, second: str) -> float:
        least = np.inf
        for joint_a, shape_a, radius_a in self.shapes[first]:
            for joint_b, shape_b, radius_b in self.shapes[second]:
                result = coal.DistanceResult()
                poses = (self._pose(joint_a), self._pose(joint_b))
                value = coal.distance(
                    shape_a, poses[0], shape_b, poses[1], coal.DistanceRequest(True), result
                )
                least = min(least, value - radius_a - radius_b)
        return float(least)

    def _pose(self, joint: int) -> coal.Transform3s:
        place = self.data.oMi[joint]
        return coal.Transform3s(place.rotation, place.translation)


def _convex(vertices: Array) -> coal.CollisionGeometry:
    points = coal.StdVec_Vec3s()
    for vertex in vertices:
        points.append(vertex)
    return coal.Convex.convexHull(points, False, None)


def _tree(triangles: Array) -> coal.BVHModelOBBRSS:
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(triangles), 3 * len(triangles))
    for a, b, c in triangles:
        model.addTriangle(a, b, c)
    model.endModel()
    return model
