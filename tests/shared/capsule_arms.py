"""Arms whose links are capsules, and other bodies with distances that are known by hand."""

from __future__ import annotations

import numpy as np
from urdf_texts import check_urdf_text

from feasibility.collisions import Bodies, HalfSpace, Obstacle, Pair
from robots.pinocchio_model import robot_from_urdf
from robots.shapes import Solid, Triangles
from robots.urdf import Capsule

WIDE = 'lower="-10" upper="10" effort="1" velocity="1"'


def planar_arm(lengths, kinds=None, axes=None):
    """Links along x, each turning about z of the one before it (or sliding along its axis)."""
    kinds = kinds or ["revolute"] * len(lengths)
    axes = axes or [(1, 0, 0) if kind == "prismatic" else (0, 0, 1) for kind in kinds]
    text = '<robot name="arm"><link name="base"/>'
    before, at = "base", 0.0
    for k, (length, kind, axis) in enumerate(zip(lengths, kinds, axes, strict=True), start=1):
        text += (
            f'<link name="link{k}"/><joint name="joint{k}" type="{kind}"><parent link="{before}"/>'
            f'<child link="link{k}"/><origin xyz="{at} 0 0"/><axis xyz="{axis[0]} {axis[1]} '
            f'{axis[2]}"/><limit {WIDE}/></joint>'
        )
        before, at = f"link{k}", length
    text += (
        f'<link name="tool"/><joint name="mount" type="fixed"><parent link="{before}"/>'
        f'<child link="tool"/><origin xyz="{at} 0 0"/></joint></robot>'
    )
    return robot_from_urdf(check_urdf_text(text), name="arm", tool_frame="tool")


def along_x(length, start=0.0):
    """Placement of a capsule of that length that begins at x = start."""
    place = np.eye(4)
    place[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    place[0, 3] = start + 0.5 * length
    return place


def capsule_links(lengths, radius):
    """A capsule along each link."""
    return tuple(
        Solid(f"link{k}", k, along_x(length), Capsule(radius, length))
        for k, length in enumerate(lengths, start=1)
    )


def at(x=0.0, y=0.0, z=0.0, rotation=None):
    """A placement (4, 4)."""
    place = np.eye(4)
    place[:3, 3] = x, y, z
    if rotation is not None:
        place[:3, :3] = rotation
    return place


def box_mesh(size, closed=True):
    """A box of 12 triangles about the origin, outward; one is left out where it is not closed."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    faces = np.array(
        [
            *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5]),
            *([0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]),
            *([0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
        ]
    )
    return Triangles(signs * np.array(size) / 2.0, faces if closed else faces[:-1], closed)


def bodies_of(solids, scene=(), pairs=(), soups=()):
    """Bodies as the judge wants them; it never looks at the polytopes."""
    return Bodies(tuple(solids), (), tuple(soups), tuple(scene), tuple(pairs))


def wall_at(x):
    """The half space beyond x = `x`."""
    return Obstacle("wall", HalfSpace(), at(x, rotation=[[0, 0, -1], [0, 1, 0], [1, 0, 0]]))


def pair(first, second, clearance=0.0):
    return Pair(first, second, clearance)
