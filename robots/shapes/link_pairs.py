"""Which pairs of an arm's bodies are checked, and which are left out, each with its reason.

How often pairs of bodies collide is asked of coal, in random configurations of an arm. A link's
convex hull may be too crude: two joints apart on an L-shaped arm, such as base and upper arm of a
ur5, the hulls of two links overlap in a good part of all configurations, in which the links
themselves are well apart. Such links are cut into pieces.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Literal

import numpy as np
import pinocchio as pin

from coverable.arrays import Array
from coverable.errors import Fault, listed
from robots.errors import RobotError
from robots.robot import Robot
from robots.shapes.bodies import Polytope, Solid
from robots.shapes.coal_shapes import coal_body, with_contacts
from robots.shapes.links import LinkShapes, outer_bodies
from robots.urdf.elements import UrdfError
from robots.urdf.srdf import DisabledPairs, read_srdf

Why = Literal["rigid", "adjacent", "always", "allowed", "srdf"]
FIRST_LOOK = 30  # configurations after which most pairs are known not to collide always
MOST_LISTED = 12  # pairs or links in one note
SAMPLES = 1000
SEED = 0
LOOKED_AT = 200  # configurations in which hulls are compared with links
TOO_OFTEN = 0.05  # [1] of them, in which hulls meet and links do not: ur5 0.29, panda 0.03
WITHOUT_LIMITS = {"revolute": np.pi, "continuous": np.pi, "prismatic": 1.0}  # to both sides

Pair = tuple[str, str]


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
) -> LinkPairs:
    """Sort the pairs of links, and of links and tool, into those that are checked and others.

    A pair is left out where no motion changes the distance ("rigid"), where nothing with a shape
    lies between the two along the arm ("adjacent": they meet at their joint, and what keeps them
    apart otherwise are its limits), where the user says so ("allowed"), where an SRDF does
    ("srdf"), and where both the convex bodies and the exact shapes collide in each of 1,000 random
    configurations and at zero ("always"). A pair that never collided in these is checked: samples
    prove nothing. Of the pairs that are allowed, others than these are passed over.

    Raises:
        RobotError: the SRDF is of another robot.
    """
    joint, notes = {body.owner: body.joint for body in shapes.polytopes}, list[str]()
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
    return _measured(robot, shapes, reasons, notes)


def _measured(
    robot: Robot, shapes: LinkShapes, reasons: dict[Pair, Why | None], notes: list[str]
) -> LinkPairs:
    """Find the pairs that always collide, and how often the others that are left out do."""
    q = random_configurations(robot)
    q[0], bodies = np.clip(0.0, robot.lower, robot.upper), shapes.polytopes
    open_pairs = [pair for pair, why in reasons.items() if why is None]
    early = collision_rates(robot, bodies, open_pairs, q[:FIRST_LOOK])
    suspects = [pair for pair, rate in early.items() if rate == 1.0]
    moving = [pair for pair, why in reasons.items() if why not in (None, "rigid")] + suspects
    rates = collision_rates(robot, bodies, moving, q)
    alike = [pair for pair in suspects if rates[pair] == 1.0]
    as_they_are = collision_rates(robot, shapes.solids, alike, q)
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
    """What is wrong with an SRDF, to be reported with other faults before any shape is made."""
    try:
        return _strangers(path, read_srdf(path), links)
    except UrdfError as error:
        return [fault._replace(place=error.source) for fault in error.faults]


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
    """The same shapes, with crude links of pairs that stay apart cut into convex pieces."""
    q = random_configurations(robot)[:LOOKED_AT]
    as_hulls = collision_rates(robot, shapes.polytopes, pairs, q)
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
