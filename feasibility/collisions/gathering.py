"""Everything that can collide in one problem, and which pairs have to stay clear of each other."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from coverable.errors import ArgumentError
from feasibility.collisions.problem_bodies import (
    Bodies,
    Pair,
    Soup,
    at_rest,
    bounded,
    overlapping,
    scene_solids,
    tool_solids,
)
from feasibility.collisions.scene import ToolShape
from feasibility.collisions.settings import Collision
from feasibility.collisions.words import SURFACE, TOOL
from robots.robot import Robot
from robots.shapes.bodies import Fineness, Polytope, Solid, Triangles
from robots.shapes.coal_shapes import coal_distance
from robots.shapes.link_pairs import LeftOut, LinkPairs, link_pairs, with_crude_links_cut
from robots.shapes.links import LinkShapes, link_shapes, outer_bodies, tool_line, tool_reach
from surfaces.sheet import sheet_of
from surfaces.surface import Surface

KEPT = 16  # problems whose bodies are remembered: `explain` and `place` come back to them
NO_PAIRS = LinkPairs((), (), ())
BARE = 0.02  # [m] from the tool point to the nearest body, from which on that is to be said
FURTHEST = 1e4  # [m] that an arm on a rail without end is taken to get


@lru_cache(maxsize=KEPT)
def gathered(robot: Robot, surface: Surface, collision: Collision, standoff: float) -> Bodies:
    """What `gather` says, remembered: its arguments are values that nobody changes."""
    faults = collision.unknown_names(robot.link_names)
    if faults:
        raise ArgumentError([fault.renamed({}, "collision") for fault in faults])
    arm, pairs = _arm_of(robot, collision)
    solids, polytopes, soups = arm.solids, [*arm.polytopes], list[Soup]()
    if collision.surface and surface.wall is not None:
        sheet = sheet_of(surface.wall, thickness=collision.thickness)
        soups.append(Soup(SURFACE, sheet.triangles, sheet.deviation, False, sheet))
    scene = scene_solids(collision.scene, robot)
    reach = _reach(robot, polytopes, scene, soups)
    carried = [bounded(one, reach) for one in scene if one.joint]
    for found in (at_rest(one, reach) for one in scene if not one.joint):
        if isinstance(found, Soup):
            soups.append(found)
        else:
            polytopes += found
    for one in carried:  # one hull would close the hollows of a fixture
        hollow = isinstance(one.geometry, Triangles)
        polytopes += outer_bodies(one, "pieces" if hollow else collision.shapes)
    joints = {solid.owner: solid.joint for solid in solids}
    owners = _tool_owners(collision, joints, robot)
    asked, left_out = _sorted_out(
        collision, joints, scene, owners, pairs, touching=not standoff > 0.0
    )
    return Bodies(
        solids=(*solids, *carried),
        polytopes=tuple(polytopes),
        soups=tuple(soups),
        scene=scene,
        pairs=tuple(asked),
        left_out=tuple(left_out),
        unchecked=(*arm.unchecked, *bare_stretch(robot, collision)),
        checked=collision.checked,
        notes=(
            *arm.notes,
            *pairs.notes,
            *(note for one in collision.scene for note in one.notes),
            *overlapping(collision, polytopes, left_out),
            *_beside_standoff(robot, solids, collision, owners, asked, standoff),
        ),
    )


@lru_cache(maxsize=KEPT)
def _arm(
    robot: Robot,
    fineness: Fineness,
    tool: tuple[ToolShape, ...],
    allow: tuple[tuple[str, str], ...],
    srdf: str | None,
    with_itself: bool,
) -> tuple[LinkShapes, LinkPairs]:
    """Bodies of links and tool, and the pairs of them, unless none are asked for.

    Surface, places and clearances leave them as they are: it takes most of the time of `gather`.
    """
    shapes, mounted, pairs = link_shapes(robot, fineness), tool_solids(tool, robot), NO_PAIRS
    hulls = (body for solid in mounted for body in outer_bodies(solid))
    solids, polytopes = (*shapes.solids, *mounted), (*shapes.polytopes, *hulls)
    shapes = replace(shapes, solids=solids, polytopes=polytopes)
    if with_itself:
        pairs = link_pairs(robot, shapes, allow, srdf)
        beside = {solid.owner for solid in mounted}
        of_links = [pair for pair in pairs.checked if beside.isdisjoint(pair)]
        cut = with_crude_links_cut(robot, shapes, of_links) if fineness == "hulls" else shapes
        if cut is not shapes:
            shapes, pairs = cut, link_pairs(robot, cut, allow, srdf)
    return shapes, pairs


def _arm_of(robot: Robot, collision: Collision) -> tuple[LinkShapes, LinkPairs]:
    """See `_arm`."""
    asked = collision.tool, collision.allow, collision.srdf, collision.self_
    return _arm(robot, collision.shapes, *asked)


def bare_stretch(robot: Robot, collision: Collision) -> dict[str, str]:
    """The way from flange to tool point where no body is on it, by its name: what is to be said.

    Raises:
        RobotError: no link has a shape, or the SRDF is not of this arm.
    """
    (arm, _), line = _arm_of(robot, collision), tool_line(robot)
    bare = float(np.linalg.norm(line.ends[1] - line.ends[0]))
    point = Polytope("tool point", line.joint, line.ends[1:], 0.0)
    for body in arm.polytopes:
        if body.joint == line.joint and bare > BARE:
            bare = min(bare, coal_distance(point, body))
    if bare <= BARE:
        return {}
    frame = robot.model.frames[robot.tool_link_id].placement.homogeneous
    start, end = (line.ends - frame[:3, 3]) @ frame[:3, :3]
    length = float(np.linalg.norm(end - start))
    x, y, z = ((end - start) / length).round(6).tolist()
    rpy_deg = [0.0, math.degrees(math.acos(z)), math.degrees(math.atan2(y, x))]
    rows = {"position": 0.5 * (start + end), "rpy_deg": np.array(rpy_deg)}
    placed = (f"{key} = {(row.round(4) + 0.0).tolist()}" for key, row in rows.items() if row.any())
    radius, straight = 0.5 * BARE, round(length - BARE, 4)
    what = ", ".join([f'kind = "capsule", radius = {radius:g}, length = {straight:g}', *placed])
    return {
        f"{line.flange} to TCP": f"the last {1e3 * bare:.0f} mm from {line.flange} to the TCP have "
        f"no body, so nothing is checked there; [[collision.tool]] with {what} would do"
    }


def _beside_standoff(
    robot: Robot, solids: Iterable[Solid], collision: Collision, tool: set[str],
    pairs: Iterable[Pair], standoff: float,
) -> list[str]:  # fmt: skip
    """That clearances of the tool, or what it reaches beyond its point, are more than it leaves."""
    needed, notes = {pair.first: pair.clearance for pair in pairs if pair.second == SURFACE}, []
    if collision.surface and collision.tool_clearance > standoff:
        notes.append(
            f"tool_clearance ({1e3 * collision.tool_clearance:g} mm) is larger than the standoff "
            f"({1e3 * standoff:g} mm): no shape of the tool may be nearer than "
            f"{1e3 * (collision.tool_clearance - standoff):g} mm to the tool point."
        )
    return notes + [
        f"shapes of {owner} reach {1e3 * beyond:.1f} mm beyond the tool point, and have to stay "
        f"{1e3 * needed[owner]:g} mm off the surface; the standoff is {1e3 * standoff:g} mm"
        for owner, beyond in tool_reach(robot, solids).items()
        if owner in tool and beyond + needed.get(owner, -math.inf) > standoff
    ]


def _reach(
    robot: Robot, polytopes: Sequence[Polytope], scene: Iterable[Solid], soups: Iterable[Soup]
) -> float:
    """m, no point of the arm is further from the origin of the root frame.

    The steps from joint to joint, the slides, and the furthest point of a body from its joint. With
    the surface and the carried objects among these, it holds for any body from any joint's frame.
    """
    steps = sum(float(np.linalg.norm(place.translation)) for place in robot.model.jointPlacements)
    slides = np.maximum(np.abs(robot.lower), np.abs(robot.upper))[robot.prismatic].sum()
    wide = max(
        float(np.linalg.norm(body.vertices, axis=1).max()) + body.radius for body in polytopes
    )
    carried = [one.placement[:3, 3] for one in scene if one.joint]
    for points in (*carried, *(soup.triangles for soup in soups if carried)):
        wide = max(wide, float(np.linalg.norm(points, axis=-1).max(initial=0.0)))
    return min(steps + float(slides) + wide, FURTHEST)


def _tool_owners(collision: Collision, joints: Mapping[str, int], robot: Robot) -> set[str]:
    """The owners that are the tool: those named, or all that move with the last joint.

    Where the tool is fixed in the world and the arm holds the part, the whole world moves with the
    last joint: the tool is then what is mounted on the tool frame, or else the link of that name.
    """
    if collision.tool_links:
        return {*collision.tool_links, TOOL} & joints.keys()
    if robot.model.frames[robot.world_frame_id].parentJoint == robot.n:
        return {TOOL if collision.tool else robot.tool_frame} & joints.keys()
    return {owner for owner, joint in joints.items() if joint == robot.n}


def _sorted_out(
    collision: Collision,
    joints: Mapping[str, int],
    scene: Sequence[Solid],
    tool: set[str],
    links: LinkPairs,
    touching: bool,
) -> tuple[list[Pair], list[LeftOut]]:
    """Who must stay clear of whom; who is left out, and why.

    `joints` carry the links and the tool, `links` are their pairs with each other, and `tool` are
    the tool's owners, which may be `touching` the surface.
    """
    own = {one.name: one.clearance for one in collision.scene}
    clearances = {frozenset(pair[:2]): pair[2] for pair in collision.clearances}
    allowed = {frozenset(pair) for pair in collision.allow}
    asked, left_out = list[Pair](), [*links.left_out]

    def sort(first: str, second: str, clearance: float, why: str = "") -> None:
        names = frozenset((first, second))
        if why or names in allowed:
            left_out.append(LeftOut(first, second, why or "allowed"))
        else:
            asked.append(Pair(first, second, clearances.get(names, clearance)))

    def wanted(*names: str) -> float:
        given = (own[name] for name in names)
        return max(collision.clearance if one is None else one for one in given)

    for pair in links.checked:
        sort(*pair, collision.clearance)
    for owner, joint in joints.items():
        for one in scene:
            sort(owner, one.owner, wanted(one.owner), "rigid" if one.joint == joint else "")
        if collision.surface:
            mine = owner in tool
            why = "rigid" if not joint else "contact" if mine and touching else ""
            sort(owner, SURFACE, collision.tool_clearance if mine else collision.clearance, why)
    for number, one in enumerate(scene):
        if collision.surface and one.joint:
            sort(one.owner, SURFACE, wanted(one.owner))
        for other in scene[number + 1 :]:
            if other.joint != one.joint:
                sort(one.owner, other.owner, wanted(one.owner, other.owner))
    return asked, left_out
