"""Bodies of made-up shapes on real and made-up arms, and what coal says of them."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
from arm_urdfs import joint
from numpy.typing import NDArray
from random_arms import robot_of

from feasibility.collisions import Bodies, Pair, Soup
from robots import Robot
from robots.shapes import Polytope

Array = NDArray[np.float64]


def serial_arm(rng: np.random.Generator, kinds: str, length: float = 0.3) -> Robot:
    """A chain of joints, R or P, with axes and placements made up."""
    named = {"R": "revolute", "P": "prismatic"}
    return robot_of(
        [
            joint(k, named[kind], *rng.normal(size=(2, 3)) * [[length], [1.0]], rng.normal(size=3),
                  (-3.0, 3.0))
            for k, kind in enumerate(kinds, start=1)
        ]
    )  # fmt: skip


def hulls(rng: np.random.Generator, n: int, size: float = 0.08, at: float = 0.15) -> list[Polytope]:
    """One to three clouds of vertices around each joint, the root included: owners b0 to bn."""
    bodies = []
    for k in range(n + 1):
        for _ in range(int(rng.integers(1, 4))):
            count = int(rng.integers(4, 30))
            cloud = rng.normal(size=(count, 3)) * size * rng.uniform(0.2, 1.0, 3)
            cloud += rng.normal(size=3) * at
            bodies.append(Polytope(f"b{k}", k, cloud, float(rng.choice([0.0, 0.02]))))
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
                result, asked = coal.DistanceResult(), coal.DistanceRequest(True)
                a, b = self._pose(joint_a), self._pose(joint_b)
                apart = coal.distance(shape_a, a, shape_b, b, asked, result)
                least = min(least, apart - radius_a - radius_b)
        return float(least)

    def _pose(self, joint: int) -> coal.Transform3s:
        place = self.data.oMi[joint]
        return coal.Transform3s(place.rotation, place.translation)


def _convex(vertices: Array) -> coal.CollisionGeometry:
    points = coal.StdVec_Vec3s()
    points.extend(list(vertices))
    return coal.Convex.convexHull(points, False, None)


def _tree(triangles: Array) -> coal.BVHModelOBBRSS:
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(triangles), 3 * len(triangles))
    for corners in triangles:
        model.addTriangle(*corners)
    model.endModel()
    return model
