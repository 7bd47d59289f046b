"""Which pairs of an arm's bodies are checked, and which are left out, each with its reason."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from coverable.errors import Fault, listed
from robots.errors import RobotError
from robots.robot import Robot
from robots.shapes.bodies import Polytope, Solid
from robots.shapes.links import LinkShapes, outer_bodies
from robots.shapes.sampling import Pair, collision_rates, random_configurations
from robots.urdf.elements import UrdfError
from robots.urdf.srdf import DisabledPairs, read_srdf

Why = Literal["rigid", "adjacent", "always", "allowed", "srdf"]
FIRST_LOOK = 30  # configurations after which most pairs are known not to collide always
MOST_LISTED = 12  # pairs or links in one note


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Two owners of bodies that are not checked against each other, and why."""

    first: str
    second: str
    why: str
    """adjacent, rigid, always, allowed, srdf or contact."""
    rate: float | None = None
    """Share of random configurations in which they collide; None where it was not measured."""


@dataclass(frozen=True, slots=True)
class LinkPairs:
    """The pairs of owners of bodies."""

    checked: tuple[Pair, ...]
    """Base to tip."""
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]
    """What a user should know, one sentence each."""


def link_pairs(
    robot: Robot,
    shapes: LinkShapes,
    allow: Iterable[Pair] = (),
    srdf: str | os.PathLike[str] | None = None,
    tool: Sequence[Solid] = (),
) -> LinkPairs:
    """Sort the pairs of links, and of links and tool, into those that are checked and others.

    A pair is left out where no motion changes the distance ("rigid"), where nothing with a shape
    lies between the two along the arm ("adjacent": they meet at their joint, and what keeps them
    apart otherwise are its limits), where the user says so ("allowed"), where an SRDF does
    ("srdf"), and where both the convex bodies and the exact shapes collide in each of 1,000 random
    configurations and at zero ("always"). A pair that never collided in these is checked: samples
    prove nothing.

    Args:
        robot: the arm.
        shapes: of its links.
        allow: pairs of names that the user leaves out; others than these are passed over.
        srdf: path of an SRDF.
        tool: exact shapes on the last joint that are no link's.

    Raises:
        RobotError: the SRDF is of another robot.
    """
    bodies = (*shapes.polytopes, *(body for one in tool for body in outer_bodies(one)))
    joint, notes = {body.owner: body.joint for body in bodies}, list[str]()
    allowed, disabled = {frozenset(pair) for pair in allow}, set[frozenset[str]]()
    if srdf is not None:
        pairs = read_srdf(srdf)
        faults = _strangers(srdf, pairs, {*robot.link_names, *joint})
        if faults:
            raise RobotError(faults, f"robot {robot.name!r}")
        disabled = {frozenset(pair) for pair in pairs.taken}
        for why, count in pairs.ignored:
            reason_given = f"the reason {why!r}" if why else "no reason"
            plural = "s are" if count > 1 else " is"
            notes.append(
                f"{count} pair{plural} not taken from the SRDF, which gives {reason_given}"
            )

    def reason(first: str, second: str) -> Why | None:
        pair = frozenset((first, second))
        if joint[first] == joint[second]:
            return "rigid"
        if _nothing_between(first, second, shapes, robot):
            return "adjacent"
        if pair in allowed:
            return "allowed"
        return "srdf" if pair in disabled else None

    order = sorted(joint, key=lambda owner: joint[owner])
    reasons = {pair: reason(*pair) for pair in combinations(order, 2)}
    return _measured(robot, bodies, (*shapes.solids, *tool), reasons, notes)


def _measured(
    robot: Robot,
    bodies: Sequence[Polytope],
    solids: Sequence[Solid],
    reasons: dict[Pair, Why | None],
    notes: list[str],
) -> LinkPairs:
    """Find the pairs that always collide, and how often the others that are left out do."""
    q = random_configurations(robot)
    q[0] = np.clip(0.0, robot.lower, robot.upper)
    open_pairs = [pair for pair, why in reasons.items() if why is None]
    early = collision_rates(robot, bodies, open_pairs, q[:FIRST_LOOK])
    suspects = [pair for pair, rate in early.items() if rate == 1.0]
    moving = [pair for pair, why in reasons.items() if why not in (None, "rigid")] + suspects
    rates = collision_rates(robot, bodies, moving, q)
    alike = [pair for pair in suspects if rates[pair] == 1.0]
    as_they_are = collision_rates(robot, solids, alike, q)
    parted = [pair for pair, rate in as_they_are.items() if rate < 1.0]
    found = reasons | {pair: "always" for pair in alike if pair not in parted}
    if parted:
        named = [" - ".join(pair) for pair in parted]
        notes.append(
            f"checked, though their convex bodies collide in each of {len(q):,} random "
            "configurations, where their exact shapes do not: "
            f"{listed(named, MOST_LISTED)}; the search finds nothing with one hull for each shape, "
            "and may with convex pieces"
        )
    left_out = [
        LeftOut(*pair, why, rates.get(pair)) for pair, why in found.items() if why is not None
    ]
    always = [f"{pair.first} - {pair.second}" for pair in left_out if pair.why == "always"]
    if always:
        notes.append(
            f"not checked, because their convex bodies collide in each of {len(q):,} random "
            f"configurations: {listed(always, MOST_LISTED)}; finer shapes may part them"
        )
    checked = tuple(pair for pair, why in found.items() if why is None)
    return LinkPairs(checked, tuple(left_out), tuple(notes))


def _nothing_between(first: str, second: str, shapes: LinkShapes, robot: Robot) -> bool:
    """Is every link between two owners a mere frame? What is no link hangs on the tool's link."""
    tree = {*shapes.parents, *shapes.parents.values()}

    def upwards(owner: str) -> list[str]:  # and those that carry it, up to the root
        links = [owner if owner in tree else robot.tool_frame]
        while links[-1] in shapes.parents:
            links.append(shapes.parents[links[-1]])
        return links

    a, b = upwards(first), upwards(second)
    met = next(link for link in a if link in b)
    return shapes.embodied.isdisjoint(({*a} ^ {*b} | {met}) - {first, second})


def _strangers(
    path: str | os.PathLike[str], pairs: DisabledPairs, known: Collection[str]
) -> list[Fault]:
    """A fault where an SRDF names links that an arm does not have."""
    unknown = sorted(pairs.named.difference(known))
    links = ", ".join(sorted(known)[:MOST_LISTED])
    what = f"names links that this robot does not have: {listed(unknown, MOST_LISTED)}"
    fault = Fault("", what, os.fspath(path), f"is it of another robot? It has {links}")
    return [fault] if unknown else []


def faults_of_srdf(path: str | os.PathLike[str], links: Collection[str]) -> list[Fault]:
    """What is wrong with an SRDF, to be reported with other faults before any shape is made.

    Args:
        path: of the file.
        links: all links of the arm.
    """
    try:
        return _strangers(path, read_srdf(path), links)
    except UrdfError as error:
        return [fault._replace(place=error.source) for fault in error.faults]
