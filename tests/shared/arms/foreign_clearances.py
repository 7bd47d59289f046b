"""Distances of bodies by python-fcl, which the judge does not use, at samples of a motion."""

from functools import lru_cache

import numpy as np
import pinocchio as pin
from plain import geometry_of
from referee import Joint, Scene, Shape, fcl_object
from scipy.optimize import nnls

from robots.shapes.bodies import Triangles

cached_model = lru_cache(maxsize=256)(lambda geometry: fcl_object(geometry_of(geometry)))


def distance_from_hull(point, vertices):
    """m, of a point: of its nearest convex combination of the vertices, by least squares."""
    shares, _ = nnls(np.vstack([vertices.T, np.full(len(vertices), 1e4)]), np.append(point, 1e4),
                     maxiter=1000)  # fmt: skip
    return np.linalg.norm(shares / shares.sum() @ vertices - point)


class Joints:
    """An arm as the referee wants it, with joints for links (0: the root), by Pinocchio."""

    seen_from = None

    def __init__(self, robot):
        self.model, self.data = robot.model, robot.model.createData()
        self.neutral, self.names = pin.neutral(self.model), robot.joint_names
        self.limits = np.column_stack([robot.lower, robot.upper])
        places = [place.homogeneous for place in self.model.jointPlacements][1:]
        named = zip(places, (*robot.joint_names, *[""] * len(places)), strict=False)
        slides = dict(zip(robot.joint_names, robot.prismatic, strict=True))
        self.joints = [
            Joint(name, "prismatic" if slides.get(name) else "revolute", "", "", at, None, (0, 0))
            for at, name in named
        ]

    def frames(self, q):
        """(1, 4, 4) of every joint at one configuration (1, n)."""
        pin.forwardKinematics(self.model, self.data, pin.integrate(self.model, self.neutral, q[0]))
        return {k: place.homogeneous[None] for k, place in enumerate(self.data.oMi)}


class ForeignScene(Scene):
    """The bodies of a problem as fcl's objects: half spaces are deep boxes, soups meshes."""

    def __init__(self, robot, bodies):
        self.robot, self.asked = robot, bodies
        self.arm, self.bodies = Joints(robot), {}
        self.pairs = [(pair.first, pair.second, pair.clearance) for pair in bodies.pairs]
        for solid in bodies.exact:
            self._add(solid.owner, solid.joint or None, solid.placement, solid.geometry)
        for soup in bodies.soups:
            if soup.owner not in self.bodies:
                faces = np.arange(3 * len(soup.triangles)).reshape(-1, 3)
                mesh = Triangles(soup.triangles.reshape(-1, 3), faces, soup.closed)
                self._add(soup.owner, None, np.eye(4), mesh, soup.deviation)

    def _add(self, owner, joint, placement, geometry, off=0.0):
        shape = Shape(joint, np.asarray(placement), geometry_of(geometry), off)
        self.bodies.setdefault(owner, []).append((shape, cached_model(geometry)))

    def is_clear(self, q):
        """Is no pair too near? What touches is, whatever is asked."""
        found = self.distances(q)
        return bool(((found >= [pair[2] for pair in self.pairs]) & (found > 0.0)).all())
