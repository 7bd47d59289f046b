"""Does the tool collide in every pose that covers a cell? It is an arm of its own then.

Over a cell the tool has three free numbers, the joints of an arm that stands at the target: two
tilt it about axes across the approach direction, the second of which goes with the first, and the
third rolls it about its own axis. All meet in its tool point, which is within the tolerance of the
target. Tilted by a and b its axis is off the approach by the angle whose cosine is cos a cos b.

So `everywhere` says whether bodies are too near all over a box of these. What the arm does to bring
the tool there, and whether it can, does not matter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from coverable.arrays import Array
from feasibility.certification.collisions.everywhere import Overlapping, Points
from feasibility.collisions.problem_bodies import Bodies
from robots.robot import Robot
from robots.shapes.bodies import Triangles

MOST_BOXES = 100_000
BATCH = 512  # boxes at a time
MOST_POINTS = 20_000  # of bodies at once, each compared with all planes of another: 0.1 GB
POSES = 12  # directions of tilt, and rolls, among which the best is told
FINEST = 40  # parts of the tool's reach that triangles of a sheet are cut to
CUTS = 40  # of a triangle, at most
WIDE = np.array([np.pi, 0.5 * np.pi, np.pi])  # [rad] half the range of all directions and rolls
Z = np.array([0.0, 0.0, 1.0])


class Collides(NamedTuple):
    """What became of the claim that something collides wherever the tool covers a cell."""

    confirmed: bool
    boxes: int
    """How many boxes, of tilt and roll or of joint values, were looked at."""
    pairs: tuple[tuple[str, str], ...] = ()
    """Where it is confirmed: one of them collides; the first is that of `distance`."""
    distance: float = np.nan
    """m, of that pair in the best of some poses all over the cone; negative where they overlap."""


def never_clear(
    robot: Robot,
    bodies: Bodies,
    cone: float,
    tolerance: float,
    point: Array,
    approach: Array,
    tick: Callable[[], object] = lambda: None,
    most: int = MOST_BOXES,
) -> Collides:
    """Is it confirmed that the tool collides in every pose over a target?

    Its point is within the tolerance (m) of `point` (3,), and its axis within the cone (rad) of
    `approach`, a unit vector. Of the arm only what moves with the tool counts.

    Args:
        tick: called now and then; what it raises ends the work.
        most: how many boxes may be looked at.
    """
    tool, looked, used = _alone(robot, bodies, point, approach), 0, set[int]()
    if not tool.most_points:
        return Collides(False, 0)
    batch, cone = min(BATCH, max(1, MOST_POINTS // tool.most_points)), min(cone, np.pi)
    high = np.where([cone < 0.5 * np.pi, cone < 0.5 * np.pi, False], cone, WIDE)
    boxes = np.array([[-high, high]])
    while len(boxes):
        boxes, some = boxes[:-batch], boxes[-batch:]
        looked += len(some)
        if looked > most:
            return Collides(False, looked)
        tick()
        (low, high), middle = some.swapaxes(0, 1), some.mean(axis=1)
        found = tool.deepest(low, high, point, tolerance)
        nothing = np.isinf(found.ratio)
        if (nothing & (_least_tilt(middle, middle) <= cone)).any():
            return Collides(False, looked)  # nor would a smaller box be ruled out
        left = np.flatnonzero(found.ratio >= 1.0)
        used |= set(np.delete(found.pair, left).tolist())
        effect = np.where(nothing[:, None], (high - low) * [1.0, 1.0, 0.0], found.effect)
        along, row = effect.argmax(axis=1)[left], np.arange(len(left))
        halves = np.stack([some[left], some[left]])
        halves[0, row, 1, along] = halves[1, row, 0, along] = middle[left, along]
        halves = halves.reshape(-1, 2, 3)
        boxes = np.concatenate([boxes, halves[_least_tilt(*halves.swapaxes(0, 1)) <= cone]])
    over, nearest = _at_best(tool, _all_over(cone), point, tolerance, batch)
    blamed = [bodies.pairs[k] for k in (nearest, *sorted(used))]
    named = dict.fromkeys((pair.first, pair.second) for pair in blamed)
    return Collides(True, looked, tuple(named), blamed[0].clearance - over - tolerance)


def _least_tilt(low: Array, high: Array) -> Array:
    """(k,) rad, no pose in boxes (k, 3) is tilted less."""
    (a, b), (_, wide) = np.maximum(np.maximum(low, -high), 0.0).T[:2], np.maximum(-low, high).T[:2]
    b = np.where(a < 0.5 * np.pi, b, wide)
    off = np.hypot(np.sin(b), np.sin(a) * np.cos(b))
    return np.asarray(np.arctan2(off, np.cos(a) * np.cos(b)) * (1.0 - 1e-9))


def _at_best(
    tool: Overlapping, poses: Array, point: Array, tolerance: float, batch: int
) -> tuple[float, int]:
    """By how much (m) bodies are too near in the best of some poses, and which pair.

    By the points of one body it is no more: only poses that could be the best are looked at with
    all of them.
    """
    parts, known = np.array_split(poses, -(-len(poses) // batch)), set[int]()
    at_least, least, nearest = np.full(len(poses), -np.inf), np.inf, 0
    while at_least.min() < least:
        k = int(at_least.argmin())
        (over,), (pair,), (body,) = tool.too_near(poses[k : k + 1], point, tolerance)
        if over < least:
            least, nearest = float(over), int(pair)
        if body not in known:
            known.add(body)
            some = [tool.too_near(part, point, tolerance, int(body))[0] for part in parts]
            at_least = np.maximum(at_least, np.concatenate(some))
        at_least[k] = np.inf
    return least, nearest


def _all_over(cone: float) -> Array:
    """(k, 3) poses all over the cone: not tilted, and in all directions by half of it and by it."""
    turns, poses = 2.0 * np.pi * np.arange(POSES) / POSES, []
    ring = cone * np.column_stack([np.cos(turns), np.sin(turns), 0.0 * turns])
    for tilt in np.concatenate([np.zeros((1, 3)), 0.5 * ring, ring]):
        (x, y, z), (_, _, u), (_, _, v) = pin.exp3(tilt)
        rolled = np.arctan2(-y, x)
        poses += [(np.arctan2(-u, v), np.arcsin(z), rolled + turn) for turn in turns]
    return np.array(poses)


def _alone(robot: Robot, bodies: Bodies, point: Array, approach: Array) -> Overlapping:
    """The tool over one target, beside what is at rest."""
    frame = robot.model.frames[robot.tool_frame_id]
    axis, model = frame.placement.rotation @ robot.approach_axis, pin.Model()
    upright = pin.Quaternion.FromTwoVectors(Z, approach).toRotationMatrix()
    joints = pin.JointModelRX(), pin.JointModelRY(), pin.JointModelRZ()
    for k, joint in enumerate(joints):
        place = pin.SE3.Identity() if k else pin.SE3(upright, point)
        model.addJoint(k, joint, place, f"turn {k}")
    model.addFrame(pin.Frame("tool", 3, 0, pin.SE3.Identity(), pin.FrameType.BODY), False)
    kinds, names = ("revolute",) * 3, tuple(model.names)[1:]
    tool = Robot("tool", model, "tool", Z, names, kinds, -WIDE, WIDE)
    onto = upright.T @ pin.Quaternion.FromTwoVectors(axis, approach).toRotationMatrix()
    mount = pin.SE3(onto, -onto @ frame.placement.translation).homogeneous
    solids = tuple(
        replace(one, joint=3, placement=mount @ one.placement) if one.joint else one
        for one in bodies.solids
        if one.joint in (0, frame.parentJoint)
    )
    own = [Points.of(one) for one in solids if one.joint]
    ends = [np.linalg.norm(one.places, axis=1) + one.deep for one in own]
    reach = max((float(one.max()) for one in ends), default=0.0)
    held = replace(bodies, solids=solids)
    return Overlapping(tool, held, _beside(held, point, reach))


def _beside(bodies: Bodies, target: Array, reach: float) -> list[Points]:
    """Points at rest, no further from a target (3,) m than the tool reaches.

    Of meshes all over their triangles, too, and of the surface. What is left out proves nothing.
    """
    found = [Points.of(one) for one in bodies.exact if not one.joint]
    sheets = {one.owner: (one.triangles, one.deviation) for one in bodies.soups}
    for one in bodies.scene:
        if isinstance(one.geometry, Triangles) and not one.joint:
            corners = one.geometry.vertices @ one.placement[:3, :3].T + one.placement[:3, 3]
            sheets[one.owner] = corners[one.geometry.faces], 0.0
    for owner, (triangles, deviation) in sheets.items():
        places = _all_over_triangles(triangles, target, reach)
        found.append(Points(owner, 0, places, np.full(len(places), -deviation)))
    clearance = max((pair.clearance for pair in bodies.pairs), default=0.0)

    def near(one: Points) -> Points:
        away = np.linalg.norm(one.places - target, axis=1)
        some = away <= reach + np.maximum(one.deep + clearance, 0.0)
        return one._replace(places=one.places[some], deep=one.deep[some])

    return [near(one) for one in found]


def _all_over_triangles(triangles: Array, target: Array, reach: float) -> Array:
    """(k, 3) m, all over those of some triangles (k, 3, 3) m that the tool may meet at a target."""
    for _ in range(CUTS):
        middles = triangles.mean(axis=1)
        wide = np.linalg.norm(triangles - middles[:, None], axis=2).max(axis=1, initial=0.0)
        near = np.linalg.norm(middles - target, axis=1) <= reach + wide
        triangles, large = triangles[near], wide[near] > reach / FINEST
        if not large.any():
            break
        some = triangles[large]  # halved at their longest sides: narrow ones do not stay narrow
        sides = np.linalg.norm(some - np.roll(some, -1, axis=1), axis=2)
        order = (sides.argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(some, order[:, :, None], axis=1).transpose(1, 0, 2)
        parts = [np.stack(half, axis=1) for half in ((a, 0.5 * (a + b), c), (0.5 * (a + b), b, c))]
        triangles = np.concatenate([triangles[~large], *parts])
    return np.asarray(triangles.mean(axis=1))
