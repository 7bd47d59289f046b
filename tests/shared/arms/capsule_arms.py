"""Arms whose links are capsules, and other bodies with distances that are known by hand."""

import numpy as np
from arm_urdfs import joint
from mesh_patches import box, stacked
from random_arms import robot_of

from coverable import Obstacle
from feasibility.collisions.problem_bodies import Bodies, Pair
from robots.shapes.bodies import HalfSpace, Solid, Triangles
from robots.urdf.link_shapes import Capsule


def planar_arm(lengths, kinds=None, axes=None):
    """Links along x, each turning about z of the one before it (or sliding along its axis)."""
    kinds = kinds or ["revolute"] * len(lengths)
    axes = axes or [(1, 0, 0) if kind == "prismatic" else (0, 0, 1) for kind in kinds]
    starts = [(x, 0.0, 0.0) for x in (0.0, *lengths)]
    named = zip(kinds, axes, starts, strict=False)
    joints = [
        joint(k, kind, start, axis=axis, limits=(-10.0, 10.0))
        for k, (kind, axis, start) in enumerate(named, start=1)
    ]
    return robot_of([*joints, joint(len(lengths) + 1, "fixed", starts[-1])])


def capsule_links(lengths, radius):
    turn = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    return tuple(
        Solid(f"link{k}", k, at(0.5 * length, rotation=turn), Capsule(radius, length))
        for k, length in enumerate(lengths, start=1)
    )


def at(x=0.0, y=0.0, z=0.0, rotation=None):
    place = np.eye(4)
    place[:3, 3] = x, y, z
    if rotation is not None:
        place[:3, :3] = rotation
    return place


def box_mesh(size, closed=True):
    """A box of 12 triangles about the origin, outward; one is left out where it is not closed."""
    corners, faces = box(*size)
    return Triangles(corners - np.array(size) / 2.0, faces if closed else faces[:-1], closed)


def fork():
    """Two arms along x, 0.6 m apart: a U-shaped link whose hull is full."""
    arm, aside = box_mesh((1.0, 0.1, 0.1)), np.array([0.0, 0.35, 0.0])
    return Triangles(*stacked(*((arm.vertices + y * aside, arm.faces) for y in (1, -1))), True)


def bodies_of(solids, scene=(), pairs=(), soups=()):
    """Bodies as the judge wants them; it never looks at the polytopes."""
    scene = tuple(Solid(one.name, 0, one.placement, one.geometry) for one in scene)
    return Bodies(tuple(solids), (), tuple(soups), scene, tuple(pairs))


def wall_at(x):
    return Obstacle("wall", HalfSpace(), at(x, rotation=[[0, 0, -1], [0, 1, 0], [1, 0, 0]]))


def pair(first, second, clearance=0.0):
    return Pair(first, second, clearance)
