"""Everything that can collide in one problem: arm, tool, surface and scene, and who meets whom."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache

from coverable_errors import ArgumentError, Fault, alternatives
from feasibility.collisions.bodies import Bodies, LeftOut, Pair
from feasibility.collisions.outlines import polytopes_of, soup_of, tool_bodies
from feasibility.collisions.settings import Collision
from robots import Robot
from robots.shapes import LinkShapes, link_pairs, link_shapes
from surfaces import Surface
from surfaces.sheet import sheet_of

SURFACE, TOOL = "surface", "tool"
KEPT = 16  # problems whose bodies are remembered: `explain` and `place` come back to them


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
    """
    if collision is None or not collision.checked:
        return None
    return _gathered(robot, surface, collision, standoff > 0.0)


@lru_cache(maxsize=KEPT)
def _gathered(robot: Robot, surface: Surface, collision: Collision, apart: bool) -> Bodies:
    """`gather`, remembered: its arguments are values that nobody changes."""
    shapes = link_shapes(robot, collision.shapes)
    solids, polytopes = tool_bodies(collision, robot)
    shapes = replace(
        shapes, solids=(*shapes.solids, *solids), polytopes=(*shapes.polytopes, *polytopes)
    )
    joints = {solid.owner: solid.joint for solid in shapes.solids}
    _refuse_unknown_names(collision, [*joints, *(one.name for one in collision.scene), SURFACE])
    outer = {one.name: polytopes_of(one, robot) for one in collision.scene}
    soups = [soup_of(one) for one in collision.scene if outer[one.name] is None]
    if collision.surface:
        soups.append(sheet_of(surface, collision.thickness))
    pairs, left_out = _pairs(robot, shapes, collision, joints, apart)
    return Bodies(
        solids=shapes.solids,
        polytopes=(*shapes.polytopes, *(body for bodies in outer.values() for body in bodies or ())),
        soups=tuple(soups),
        scene=collision.scene,
        pairs=tuple(pairs),
        left_out=tuple(left_out),
        unchecked=shapes.unchecked,
        checked=collision.checked,
        notes=shapes.notes,
    )


def _refuse_unknown_names(collision: Collision, known: Iterable[str]) -> None:
    """Refuse pairs and tool links that name nothing that is there.

    Raises:
        ArgumentError: with every such name.
    """
    names = [*known, TOOL]
    asked = [("allow", name) for pair in collision.allow for name in pair]
    asked += [("clearances", name) for *pair, _ in collision.clearances for name in pair]
    asked += [("tool_links", name) for name in collision.tool_links]
    faults = [
        Fault(f"collision.{key}", f"there is no {name!r}", expected=alternatives(name, names))
        for key, name in dict.fromkeys(asked)
        if name not in names
    ]
    if faults:
        raise ArgumentError(faults)


def tool_owners(collision: Collision, joints: Mapping[str, int], last: int) -> set[str]:
    """The owners that are the tool: those named, or all that move with the last joint.

    Args:
        collision: what is asked for.
        joints: which joint carries each owner.
        last: number of the last joint.
    """
    if collision.tool_links:
        return {*collision.tool_links, *({TOOL} & joints.keys())}
    return {owner for owner, joint in joints.items() if joint == last}


def _pairs(
    robot: Robot,
    shapes: LinkShapes,
    collision: Collision,
    joints: Mapping[str, int],
    apart: bool,
) -> tuple[list[Pair], list[LeftOut]]:
    """Who must stay clear of whom, and who is left out for which reason."""
    own = {frozenset(pair[:2]): pair[2] for pair in collision.clearances}
    allowed = {frozenset(pair) for pair in collision.allow}
    tool = tool_owners(collision, joints, robot.n)
    pairs, left_out = list[Pair](), list[LeftOut]()

    def ask(first: str, second: str, clearance: float, contact: bool = False) -> None:
        names = frozenset((first, second))
        if names in allowed or joints[first] == 0 or contact:
            why = "allowed" if names in allowed else "rigid" if joints[first] == 0 else "contact"
            left_out.append(LeftOut(first, second, why))
        else:
            pairs.append(Pair(first, second, own.get(names, clearance)))

    if collision.self_:
        links = link_pairs(robot, shapes, collision.allow, collision.srdf)
        left_out += [LeftOut(*one.pair, one.why, one.rate) for one in links.left_out]
        for first, second in links.asked:
            names = frozenset((first, second))
            pairs.append(Pair(first, second, own.get(names, collision.clearance)))
    for owner in joints:
        for one in collision.scene:
            ask(owner, one.name, collision.clearance if one.clearance is None else one.clearance)
        if collision.surface and owner in tool:
            ask(owner, SURFACE, collision.tool_clearance, contact=not apart)
        elif collision.surface:
            ask(owner, SURFACE, collision.clearance)
    return pairs, left_out
