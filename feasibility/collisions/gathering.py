"""Everything that can collide in one problem: arm, tool, surface and scene, and who meets whom."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from coverable_errors import ArgumentError
from feasibility.collisions.bodies import Bodies, LeftOut, Pair, Soup
from feasibility.collisions.outer_bodies import polytopes_of, soup_of, tool_polytopes, tool_solids
from feasibility.collisions.settings import Collision
from feasibility.collisions.words import SURFACE, TOOL
from robots import Robot
from robots.shapes import LinkShapes, Polytope, link_pairs, link_shapes
from surfaces import Surface, sheet_of

KEPT = 16  # problems whose bodies are remembered: `explain` and `place` come back to them
FURTHEST = 1e4  # [m] that an arm on a rail without end is taken to get


def gather(
    robot: Robot, surface: Surface, collision: Collision | None, standoff: float
) -> Bodies | None:
    """All bodies and pairs of one problem; None where collisions are not checked.

    Args:
        robot: the arm.
        surface: what it works on.
        collision: what is asked for.
        standoff: m; where it is 0 the tool touches the surface, and that pair is left out.

    Raises:
        RobotError: no link has a shape, or the SRDF is not of this arm.
        ArgumentError: a pair names something that is not there; all such names are given.
        SurfaceError: no bounds on the surface are known.
    """
    if collision is None or not collision.checked:
        return None
    return _gathered(robot, surface, collision, float(standoff))


@lru_cache(maxsize=KEPT)
def _gathered(robot: Robot, surface: Surface, collision: Collision, standoff: float) -> Bodies:
    """`gather`, remembered: its arguments are values that nobody changes."""
    shapes = link_shapes(robot, collision.shapes)
    shapes = replace(
        shapes,
        solids=(*shapes.solids, *tool_solids(collision.tool, robot)),
        polytopes=(*shapes.polytopes, *tool_polytopes(collision.tool, robot)),
    )
    faults = collision.unknown_names(links_of(robot))
    if faults:
        raise ArgumentError([fault._replace(key=f"collision.{fault.key}") for fault in faults])
    polytopes, soups = list(shapes.polytopes), list[Soup]()
    reach = _reach(robot, shapes.polytopes)
    for obstacle in collision.scene:
        outer, soup = polytopes_of(obstacle, reach), soup_of(obstacle)
        polytopes += outer or ()
        soups += [soup] if soup is not None else []
    if collision.surface:
        sheet = sheet_of(surface, thickness=collision.thickness)
        soups.append(Soup(SURFACE, sheet.triangles, sheet.deviation, False))
    pairs, left_out = _pairs(robot, shapes, collision, touching=not standoff > 0.0)
    return Bodies(
        solids=shapes.solids,
        polytopes=tuple(polytopes),
        soups=tuple(soups),
        scene=collision.scene,
        pairs=tuple(pairs),
        left_out=tuple(left_out),
        unchecked=shapes.unchecked,
        checked=collision.checked,
        notes=(*shapes.notes, *collision.notes_on(standoff)),
    )


def links_of(robot: Robot) -> list[str]:
    """All links of an arm, those without shapes too."""
    import pinocchio as pin

    return [frame.name for frame in robot.model.frames if frame.type == pin.FrameType.BODY]


def _reach(robot: Robot, polytopes: tuple[Polytope, ...]) -> float:
    """m, no point of the arm is further from the origin of the root frame.

    The steps from joint to joint, the slides, and the furthest point of a body from its joint.
    """
    steps = sum(float(np.linalg.norm(place.translation)) for place in robot.model.jointPlacements)
    slides = np.maximum(np.abs(robot.lower), np.abs(robot.upper))[robot.prismatic].sum()
    wide = max(
        float(np.linalg.norm(body.vertices, axis=1).max()) + body.radius for body in polytopes
    )
    return min(steps + float(slides) + wide, FURTHEST)


def tool_owners(collision: Collision, joints: Mapping[str, int], last: int) -> set[str]:
    """The owners that are the tool: those named, or all that move with the last joint.

    Args:
        collision: what is asked for.
        joints: which joint carries each owner.
        last: number of the last joint.
    """
    if collision.tool_links:
        return {*collision.tool_links, TOOL} & joints.keys()
    return {owner for owner, joint in joints.items() if joint == last}


def _pairs(
    robot: Robot, shapes: LinkShapes, collision: Collision, touching: bool
) -> tuple[list[Pair], list[LeftOut]]:
    """Who must stay clear of whom, and who is left out for which reason."""
    joints = {solid.owner: solid.joint for solid in shapes.solids}
    own = {frozenset(pair[:2]): pair[2] for pair in collision.clearances}
    tool = tool_owners(collision, joints, robot.n)
    pairs, left_out = list[Pair](), list[LeftOut]()

    def ask(first: str, second: str, clearance: float, touch: bool = False) -> None:
        why = _why_not(first, second, collision, joints)
        if why or touch:
            left_out.append(LeftOut(first, second, why or "contact"))
        else:
            pairs.append(Pair(first, second, own.get(frozenset((first, second)), clearance)))

    if collision.self_:
        links = link_pairs(robot, shapes, collision.allow, collision.srdf)
        left_out += [LeftOut(*one.pair, one.why, one.rate) for one in links.left_out]
        for first, second in links.asked:
            clearance = own.get(frozenset((first, second)), collision.clearance)
            pairs.append(Pair(first, second, clearance))
    for owner in joints:
        for one in collision.scene:
            ask(owner, one.name, collision.clearance if one.clearance is None else one.clearance)
        if collision.surface and owner in tool:
            ask(owner, SURFACE, collision.tool_clearance, touching)
        elif collision.surface:
            ask(owner, SURFACE, collision.clearance)
    return pairs, left_out


def _why_not(first: str, second: str, collision: Collision, joints: Mapping[str, int]) -> str:
    """Why a body of the arm is not asked for with one at rest; empty where it is."""
    if frozenset((first, second)) in {frozenset(pair) for pair in collision.allow}:
        return "allowed"
    return "rigid" if joints[first] == 0 else ""
