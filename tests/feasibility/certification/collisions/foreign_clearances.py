"""Distances of bodies by python-fcl, which the judge does not use, at samples of a motion."""

from __future__ import annotations

from itertools import pairwise

import fcl
import numpy as np
import pinocchio as pin

from feasibility.collisions import HalfSpace
from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

DEEP = 20.0  # m, a box in place of a half space


def fcl_model(geometry):
    """One shape for fcl; its tree of triangles for a mesh."""
    match geometry:
        case Box(size):
            return fcl.Box(*size)
        case Sphere(radius):
            return fcl.Sphere(radius)
        case Capsule(radius, length):
            return fcl.Capsule(radius, length)
        case Cylinder(radius, length):
            return fcl.Cylinder(radius, length)
        case HalfSpace():
            return fcl.Box(DEEP, DEEP, DEEP)  # fcl crashes on a half space and a mesh
        case Triangles(vertices, faces):
            model = fcl.BVHModel()
            model.beginModel(len(vertices), len(faces))
            model.addSubModel(vertices, faces)
            model.endModel()
            return model
    raise TypeError(geometry)


class ForeignScene:
    """The bodies of a problem as fcl's objects, placed by Pinocchio."""

    def __init__(self, robot, bodies):
        self.robot, self.bodies = robot, bodies
        self.data = robot.model.createData()
        self.neutral = pin.neutral(robot.model)
        self.objects = {}  # owner: [(joint, placement, model, deviation)]
        for solid in bodies.solids:
            self._add(solid.owner, solid.joint, solid.placement, solid.geometry)
        for thing in bodies.scene:
            place = np.array(thing.placement)
            if isinstance(thing.geometry, HalfSpace):
                place[:3, 3] -= 0.5 * DEEP * place[:3, 2]
            self._add(thing.name, 0, place, thing.geometry)
        for soup in bodies.soups:
            if soup.owner not in self.objects:
                faces = np.arange(3 * len(soup.triangles)).reshape(-1, 3)
                mesh = Triangles(soup.triangles.reshape(-1, 3), faces, soup.closed)
                self._add(soup.owner, 0, np.eye(4), mesh, soup.deviation)

    def _add(self, owner, joint, placement, geometry, deviation=0.0):
        entry = (joint, np.asarray(placement), fcl_model(geometry), deviation)
        self.objects.setdefault(owner, []).append(entry)

    def _placed(self, entry):
        joint, placement, model, _ = entry
        world = self.data.oMi[joint].homogeneous @ placement if joint else placement
        return fcl.CollisionObject(model, fcl.Transform(world[:3, :3], world[:3, 3]))

    def distances(self, q):
        """The distance (m) of every pair, in their order; at most 0 where they touch."""
        pin.forwardKinematics(
            self.robot.model, self.data, pin.integrate(self.robot.model, self.neutral, q)
        )
        found = []
        for pair in self.bodies.pairs:
            least = np.inf
            for one in self.objects[pair.first]:
                for other in self.objects[pair.second]:
                    first, second = self._placed(one), self._placed(other)
                    least = min(least, _distance(first, second) - one[3] - other[3])
            found.append(least)
        return np.array(found)


def _distance(first, second):
    """fcl's distance, 0 where they touch (its distance alone says -1 or more there)."""
    if fcl.collide(first, second, fcl.CollisionRequest(), fcl.CollisionResult()):
        return 0.0
    return fcl.distance(first, second, fcl.DistanceRequest(), fcl.DistanceResult())


def samples(q, step):
    """The motion q (m, n) at places at most `step` (rad or m) apart in any joint."""
    rows = [q[:1]]
    for a, b in pairwise(q):
        count = max(1, int(np.ceil(np.abs(b - a).max() / step)))
        rows.append(a + (np.arange(1, count + 1) / count)[:, None] * (b - a))
    return np.vstack(rows)
