"""How often pairs of bodies collide in random configurations of an arm, by coal.

A link's convex hull may be too crude: two joints apart on an L-shaped arm, such as base and upper
arm of a ur5, the hulls of two links overlap in a good part of all configurations, in which the
links themselves are well apart. Such links are cut into pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import pinocchio as pin

from coverable.arrays import Array
from robots.robot import Robot
from robots.shapes.bodies import Polytope, Solid
from robots.shapes.coal_shapes import coal_body, coal_shape, with_contacts
from robots.shapes.links import LinkShapes, outer_bodies

SAMPLES = 1000
SEED = 0
LOOKED_AT = 200  # configurations in which hulls are compared with links
TOO_OFTEN = 0.05  # [1] of them, in which hulls meet and links do not: ur5 0.29, panda 0.03
WITHOUT_LIMITS = {"revolute": np.pi, "continuous": np.pi, "prismatic": 1.0}  # to both sides

Pair = tuple[str, str]


def random_configurations(robot: Robot) -> Array:
    """(SAMPLES, n) configurations inside the limits, the same ones each time.

    A joint without limits turns once around, or slides a metre to both sides.
    """
    wide = np.array([WITHOUT_LIMITS[kind] for kind in robot.joint_kinds])
    lower = np.where(np.isfinite(robot.lower), robot.lower, np.minimum(-wide, robot.upper - wide))
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.maximum(wide, lower + wide))
    return np.random.default_rng(SEED).uniform(lower, upper, (SAMPLES, robot.n))


def collision_rates(
    robot: Robot,
    bodies: Sequence[Polytope | Solid],
    pairs: Sequence[Pair],
    configurations: Array,
) -> dict[Pair, float]:
    """In what share of configurations (k, n) pairs of owners collide, by coal.

    The bodies of one owner count as one. Of an exact mesh the triangles count, so what is wholly
    inside of it does not collide.
    """
    geometry, of_owner = pin.GeometryModel(), dict[str, list[int]]()
    for number, body in enumerate(bodies if pairs else ()):
        if isinstance(body, Solid):
            shape, place = coal_shape(body.geometry), body.placement
        else:
            shape, place = coal_body(body)
        title, placement = f"{number} {body.owner}", pin.SE3(np.array(place))
        entry = pin.GeometryObject(title, body.joint, 0, placement, shape)
        of_owner.setdefault(body.owner, []).append(int(geometry.addGeometryObject(entry)))
    pair_of: list[int] = []
    for number, (first, second) in enumerate(pairs):
        for couple in product(of_owner[first], of_owner[second]):
            geometry.addCollisionPair(pin.CollisionPair(*couple))
            pair_of.append(number)
    data, scratch = robot.model.createData(), geometry.createData()
    for request in scratch.collisionRequests:
        with_contacts(request)
    found = np.zeros((len(configurations), len(pairs)), dtype=bool)
    for row, q in enumerate(configurations if pairs else ()):
        pin.computeCollisions(robot.model, data, geometry, scratch, q, False)
        hits = [k for k, result in enumerate(scratch.collisionResults) if result.isCollision()]
        found[row, [pair_of[k] for k in hits]] = True
    return dict(zip(pairs, found.mean(axis=0).tolist(), strict=True))


def with_crude_links_cut(robot: Robot, shapes: LinkShapes, pairs: Sequence[Pair]) -> LinkShapes:
    """The same shapes, with the links of some pairs cut into convex pieces; others keep their hull.

    Args:
        robot: the arm.
        shapes: of its links, with one hull for each shape.
        pairs: of owners of bodies, that have to stay apart.
    """
    exact = {solid.owner for solid in shapes.solids}
    known = [pair for pair in pairs if exact.issuperset(pair)]
    q = random_configurations(robot)[:LOOKED_AT]
    as_hulls = collision_rates(robot, shapes.polytopes, known, q)
    often = [pair for pair, rate in as_hulls.items() if rate > TOO_OFTEN]
    if not often:
        return shapes
    as_they_are = collision_rates(robot, shapes.solids, often, q)
    rates = ((pair, as_hulls[pair] - as_they_are[pair]) for pair in often)
    crude = {owner for pair, rate in rates if rate > TOO_OFTEN for owner in pair}
    bodies = [
        body
        for solid in shapes.solids
        for body in outer_bodies(solid, "pieces" if solid.owner in crude else "hulls")
    ]
    return replace(shapes, polytopes=tuple(bodies)) if crude else shapes
