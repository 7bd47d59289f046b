"""Everything that can collide in one problem, and which pairs have to stay clear of each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, lru_cache, partial
from typing import NamedTuple

import numpy as np

from coverable.errors import ArgumentError
from feasibility.collisions.problem_bodies import (
    Bodies,
    Pair,
    Seat,
    Soup,
    carried_bodies,
    overlapping,
    polytopes_of,
    seats_of,
    soup_of,
    tool_solids,
)
from feasibility.collisions.scene import ToolShape
from feasibility.collisions.settings import Collision
from feasibility.collisions.words import SURFACE, TOOL
from robots.robot import Robot
from robots.shapes.bodies import Fineness, Polytope
from robots.shapes.link_pairs import LeftOut, LinkPairs, link_pairs
from robots.shapes.links import LinkShapes, link_shapes, outer_bodies
from robots.shapes.sampling import with_crude_links_cut
from robots.shapes.tool import BARE, Reach, bare_length, tool_line, tool_reach
from surfaces.sheet import sheet_of
from surfaces.surface import Surface

KEPT = 16  # problems whose bodies are remembered: `explain` and `place` come back to them
FURTHEST = 1e4  # [m] that an arm on a rail without end is taken to get


@lru_cache(maxsize=KEPT)
def gathered(robot: Robot, surface: Surface, collision: Collision, standoff: float) -> Bodies:
    """What `gather` says, remembered: its arguments are values that nobody changes."""
    faults = collision.unknown_names(robot.link_names)
    if faults:
        raise ArgumentError([fault.renamed({}, "collision") for fault in faults])
    arm = _arm_of(robot, collision)
    shapes, tool = arm.shapes, arm.tool
    solids = [*shapes.solids, *tool_solids(collision.tool, robot)]
    polytopes, soups = [*shapes.polytopes, *tool], list[Soup]()
    if collision.surface and surface.wall is not None:
        sheet = sheet_of(surface.wall, thickness=collision.thickness)
        soups.append(Soup(SURFACE, sheet.triangles, sheet.deviation, False, sheet))
    seats = seats_of(robot, collision.scene)
    reach = _reach(robot, polytopes, seats, soups)
    for obstacle in (seat.obstacle for seat in seats if not seat.joint):
        outer, soup = polytopes_of(obstacle, reach), soup_of(obstacle)
        polytopes += outer or ()
        soups += [soup] if soup is not None else []
    links = {solid.owner: solid.joint for solid in solids}
    exact, convex = carried_bodies(seats, reach, collision.shapes)
    found = _Pairs(collision, links, seats, _tool_owners(collision, links, robot))
    if collision.self_:
        found.add_links(arm.pairs())
    found.add_objects(touching=not standoff > 0.0)
    return Bodies(
        solids=(*solids, *exact),
        polytopes=(*polytopes, *convex),
        soups=tuple(soups),
        scene=tuple(seat.obstacle for seat in seats if not seat.joint),
        carried=tuple(seat for seat in seats if seat.joint),
        pairs=tuple(found.asked),
        left_out=tuple(found.left_out),
        unchecked=(*shapes.unchecked, *bare_stretch(robot, collision)),
        checked=collision.checked,
        notes=(
            *shapes.notes,
            *found.notes,
            *(note for one in collision.scene for note in one.notes),
            *overlapping([body for body in polytopes if body.joint == 0], found.at_rest),
            *collision.notes_on(standoff),
            *_beyond([r for r in arm.reaches if r.owner in found.tool], found.asked, standoff),
        ),
    )


class _Arm(NamedTuple):
    """Bodies of links and tool, and the pairs of links."""

    shapes: LinkShapes
    tool: tuple[Polytope, ...]
    reaches: tuple[Reach, ...]
    pairs: Callable[[], LinkPairs]
    """Sorts them when it is first called."""


@lru_cache(maxsize=KEPT)
def _arm(
    robot: Robot,
    fineness: Fineness,
    tool: tuple[ToolShape, ...],
    allow: tuple[tuple[str, str], ...],
    srdf: str | None,
    with_itself: bool,
) -> _Arm:
    """What surface, places and clearances leave as it is: it takes most of the time of `gather`.

    Args:
        robot, fineness, tool, allow, srdf: see `Collision`.
        with_itself: is the arm to stay clear of itself?
    """
    hulls, solids = link_shapes(robot, fineness), tool_solids(tool, robot)
    bodies = [body for solid in solids for body in outer_bodies(solid)]

    pairs_of = partial(link_pairs, robot, allow=allow, srdf=srdf, tool=solids)
    shapes = hulls
    if with_itself and fineness == "hulls":
        shapes = with_crude_links_cut(robot, hulls, pairs_of(hulls).checked)
    reaches = tool_reach(robot, shapes, bodies)
    return _Arm(shapes, tuple(bodies), reaches, cache(partial(pairs_of, shapes)))


def _arm_of(robot: Robot, collision: Collision) -> _Arm:
    """Bodies of links and tool."""
    asked = collision.tool, collision.allow, collision.srdf, collision.self_
    return _arm(robot, collision.shapes, *asked)


def bare_stretch(robot: Robot, collision: Collision) -> dict[str, str]:
    """The way from flange to tool point where no body is on it, by its name: what is to be said.

    Raises:
        RobotError: no link has a shape, or the SRDF is not of this arm.
    """
    arm, line = _arm_of(robot, collision), tool_line(robot)
    bare = bare_length(robot, [*arm.shapes.polytopes, *arm.tool])
    if not bare:
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


def _beyond(reaches: Iterable[Reach], pairs: Iterable[Pair], standoff: float) -> list[str]:
    """That bodies reach further beyond the tool point than the standoff leaves them."""
    needed = {pair.first: pair.clearance for pair in pairs if pair.second == SURFACE}
    return [
        f"shapes of {reach.owner} reach {1e3 * reach.beyond:.1f} mm beyond the tool point, and "
        f"have to stay {1e3 * needed[reach.owner]:g} mm off the surface; the standoff is "
        f"{1e3 * standoff:g} mm"
        for reach in reaches
        if reach.owner in needed and reach.beyond + needed[reach.owner] > standoff
    ]


def _reach(
    robot: Robot, polytopes: Sequence[Polytope], seats: Iterable[Seat], soups: Iterable[Soup]
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
    carried = [seat.obstacle.placement[None, :3, 3] for seat in seats if seat.joint]
    for points in (*carried, *(soup.triangles for soup in soups if carried)):
        wide = max(wide, float(np.linalg.norm(points, axis=-1).max(initial=0.0)))
    return min(steps + float(slides) + wide, FURTHEST)


def _tool_owners(collision: Collision, joints: Mapping[str, int], robot: Robot) -> set[str]:
    """The owners that are the tool: those named, or all that move with the last joint.

    Where the tool is fixed in the world and the arm holds the part, the whole world moves with the
    last joint: the tool is then what is mounted on the tool frame, or else the link of that name.

    Args:
        collision: what has to stay clear of what.
        joints: which joint carries each owner.
        robot: the arm.
    """
    if collision.tool_links:
        return {*collision.tool_links, TOOL} & joints.keys()
    if robot.model.frames[robot.world_frame_id].parentJoint == robot.n:
        return {TOOL if collision.tool else robot.tool_frame} & joints.keys()
    return {owner for owner, joint in joints.items() if joint == robot.n}


class _Pairs:
    """Who must stay clear of whom, and who is left out for which reason."""

    def __init__(
        self,
        collision: Collision,
        joints: Mapping[str, int],
        seats: Sequence[Seat],
        tool: set[str],
    ) -> None:
        """With the joints of links and tool, the objects of the scene, and the tool's owners."""
        self.collision, self.joints, self.seats, self.tool = collision, joints, seats, tool
        self.own = {frozenset(pair[:2]): pair[2] for pair in collision.clearances}
        self.allowed = {frozenset(pair) for pair in collision.allow}
        self.asked = list[Pair]()
        self.left_out = list[LeftOut]()
        self.notes: tuple[str, ...] = ()
        self.at_rest = list[tuple[str, str]]()
        """Links and objects that are rigid to each other, and not allowed to meet."""

    def add_links(self, links: LinkPairs) -> None:
        """Links against each other, and against the tool."""
        self.notes = links.notes
        self.left_out += links.left_out
        for first, second in links.checked:
            self._ask(first, second, self.collision.clearance)

    def add_objects(self, touching: bool) -> None:
        """The arm against scene and surface; the tool may be `touching` the surface."""
        general = self.collision.clearance
        for owner, joint in self.joints.items():
            for seat in self.seats:
                still = "rigid" if seat.joint == joint else ""
                self._ask(owner, seat.obstacle.name, self._wanted(seat), still)
            still = "" if joint else "rigid"
            if self.collision.surface and owner in self.tool:
                near = self.collision.tool_clearance
                self._ask(owner, SURFACE, near, still or ("contact" if touching else ""))
            elif self.collision.surface:
                self._ask(owner, SURFACE, general, still)
        for number, seat in enumerate(self.seats):
            if self.collision.surface and seat.joint:
                self._ask(seat.obstacle.name, SURFACE, self._wanted(seat))
            for other in self.seats[number + 1 :]:
                if other.joint != seat.joint:
                    wanted = max(self._wanted(seat), self._wanted(other))
                    self._ask(seat.obstacle.name, other.obstacle.name, wanted)

    def _wanted(self, seat: Seat) -> float:
        """m, the clearance of an object of the scene."""
        own = seat.obstacle.clearance
        return self.collision.clearance if own is None else own

    def _ask(self, first: str, second: str, clearance: float, why: str = "") -> None:
        """Ask for a pair, unless there is a reason why not."""
        names = frozenset((first, second))
        if why == "rigid" and second != SURFACE and names not in self.allowed:
            self.at_rest.append((first, second))
        why = why or ("allowed" if names in self.allowed else "")
        if why:
            self.left_out.append(LeftOut(first, second, why))
        else:
            self.asked.append(Pair(first, second, self.own.get(names, clearance)))
