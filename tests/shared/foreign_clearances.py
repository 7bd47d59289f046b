"""Distances of bodies by python-fcl, which the judge does not use, at samples of a motion."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import fcl
import numpy as np
import pinocchio as pin

from feasibility.collisions import HalfSpace, gather
from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

DEEP = 20.0  # m, a box in place of a half space


@lru_cache(maxsize=256)
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
        """Half spaces become deep boxes, soups become meshes."""
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

    def _couples(self, k):
        """Placed objects of both owners of pair k, and what they may be off (m)."""
        pair = self.bodies.pairs[k]
        for one in self.objects[pair.first]:
            for other in self.objects[pair.second]:
                yield (*(self._placed(entry) for entry in (one, other)), one[3] + other[3])

    def _placed(self, entry):
        joint, placement, model, _ = entry
        world = self.data.oMi[joint].homogeneous @ placement if joint else placement
        return fcl.CollisionObject(model, fcl.Transform(world[:3, :3], world[:3, 3]))

    def touches(self, k):
        """Does pair k touch, as placed last?"""
        return any(_touch(first, second) for first, second, _ in self._couples(k))

    def pair_distance(self, k):
        """m, of pair k as placed last; 0 where they touch (fcl says -1 or more there)."""
        return min(
            (0.0 if _touch(a, b) else fcl.distance(a, b, fcl.DistanceRequest())) - off
            for a, b, off in self._couples(k)
        )

    def distances(self, q, asked=None):
        """The distance (m) of every pair, or of those asked for; at most 0 where they touch."""
        model = self.robot.model
        pin.forwardKinematics(model, self.data, pin.integrate(model, self.neutral, q))
        some = range(len(self.bodies.pairs)) if asked is None else asked
        return np.array([self.pair_distance(k) for k in some])

    def is_clear(self, q):
        """Is no pair too near? What touches has a distance of 0."""
        needed = np.array([pair.clearance for pair in self.bodies.pairs])
        found = self.distances(q)
        return bool(((found >= needed) & (found > 0.0)).all())

    def least_excess(self, rows):
        """The least distance (m) over the pairs' clearances at any row (m, n) of a motion.

        No point of the arm moves further than its reach times the joints' turns: where a pair is
        further apart than that, it is not asked for again.
        """
        most = max(1.0, self._reach())
        way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(rows, axis=0)).sum(axis=1))])
        until = np.full(len(self.bodies.pairs), -1.0)
        least = np.inf
        for q, moved in zip(rows, most * way, strict=True):
            asked = np.flatnonzero(until <= moved)
            if len(asked):
                needed = [self.bodies.pairs[k].clearance for k in asked]
                excess = self.distances(q, asked) - needed
                until[asked] = moved + excess
                least = min(least, float(excess.min()))
        return least

    def _reach(self):
        """m, no point of the arm is further from any of its joints."""
        model = self.robot.model
        steps = sum(np.linalg.norm(place.translation) for place in model.jointPlacements)
        slides = np.abs([self.robot.lower, self.robot.upper]).max(axis=0)
        wide = max(
            np.linalg.norm(solid.placement[:3, 3]) + radius_about(solid.geometry)
            for solid in self.bodies.solids
        )
        return steps + slides[self.robot.prismatic].sum() + wide


def radius_about(geometry):
    """m, no point of the shape is further from its origin."""
    match geometry:
        case Box(size):
            return 0.5 * np.linalg.norm(size)
        case Sphere(radius):
            return radius
        case Capsule(radius, length) | Cylinder(radius, length):
            return radius + 0.5 * length
        case Triangles(vertices, _):
            return np.linalg.norm(vertices, axis=1).max()
    raise TypeError(geometry)


def _touch(first, second):
    return bool(fcl.collide(first, second, fcl.CollisionRequest(), fcl.CollisionResult()))


def samples(q, step):
    """The motion q (m, n) at places at most `step` (rad or m) apart in any joint."""
    rows = [q[:1]]
    for a, b in pairwise(q):
        count = max(1, int(np.ceil(np.abs(b - a).max() / step)))
        rows.append(a + (np.arange(1, count + 1) / count)[:, None] * (b - a))
    return np.vstack(rows)


def assert_clear(verdict, step_deg):
    """No pair is too near for fcl at places at most `step_deg` apart along a verdict's motion."""
    task, surface = verdict.task, verdict.cells.surface
    bodies = gather(verdict.robot, surface, task.collision, task.standoff)
    rows = samples(verdict.witness.q, np.radians(step_deg))
    excess = ForeignScene(verdict.robot, bodies).least_excess(rows)
    assert excess >= -1e-6, f"{-excess:.3g} m nearer than the clearance"
    assert verdict.certificate.min_clearance is not None
