"""Links for which one convex hull is too crude: their hulls meet where they do not.

Two joints apart on an L-shaped arm, such as base and upper arm of a ur5, the hulls of two links
overlap in a good part of all configurations, in which the links themselves are well apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from robots.robot import Robot
from robots.shapes.links import LinkShapes, outer_bodies
from robots.shapes.sampling import Pair, PairSampling, random_configurations

LOOKED_AT = 200  # random configurations
TOO_OFTEN = 0.05  # [1] of them, in which hulls meet and links do not: ur5 0.29, panda 0.03


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
    as_hulls = PairSampling(robot, shapes.polytopes).collisions(known, q).mean(axis=0)
    often = [pair for pair, rate in zip(known, as_hulls, strict=True) if rate > TOO_OFTEN]
    if not often:
        return shapes
    as_they_are = PairSampling(robot, shapes.solids).collisions(often, q).mean(axis=0)
    rates = dict(zip(known, as_hulls, strict=True))
    crude = {
        owner
        for pair, rate in zip(often, as_they_are, strict=True)
        if rates[pair] - rate > TOO_OFTEN
        for owner in pair
    }
    bodies = [
        body
        for solid in shapes.solids
        for body in outer_bodies(solid, "pieces" if solid.owner in crude else "hulls")
    ]
    return replace(shapes, polytopes=tuple(bodies)) if crude else shapes
