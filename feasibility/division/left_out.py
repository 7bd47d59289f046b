"""What stops an arm that goes on along passes; what of them all runs leave out, and why."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.collisions.problem_bodies import Pair
from feasibility.demands.motion_rates import motion_rates
from feasibility.roadmap.causes.diagnosis import cause_of
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions import search_arrays as stop
from feasibility.roadmap.motions.tracking import track
from feasibility.task import Task
from feasibility.verdict import Cause
from surfaces.passes.toolpath import PassPlaces

WORDS = {
    stop.CONE: "the tool axis would leave the cone",
    stop.ROLL: "the roll of the tool would leave its range",
    stop.SINGULAR: "the arm comes to a singularity",
    stop.LONG: "the motion takes too many steps",
    stop.FOLD: "the surface is creased, or its offset folds",
}


class PassSearch(NamedTuple):
    """A finished search along passes."""

    exploration: Exploration
    task: Task
    places: PassPlaces
    """The poses of the passes."""
    pairs: tuple[Pair, ...]
    """Of bodies that had to stay clear of each other."""
    slow: Mapping[int, Cause]
    """Poses to which no motion leads at the required speed and singular values."""


def where_it_stops(search: PassSearch, pose: int, q: Array) -> str:
    """Where a motion ends that follows the poses from a configuration q (n,) over one, and why.

    Empty where it reaches the last of them. Speed and singular values count where the task limits
    them.
    """
    exploration, task = search.exploration, search.task
    first, cause, motions = pose, "", list[Array]()
    while not cause and pose < len(exploration.cells) - 1:
        curve = exploration.curve(pose, pose + 1)
        motion, _ = track(exploration.arrays, exploration.work, curve, (0.0, 1.0), q)
        if motion is None:
            cause = _words(search)
        else:
            motions.append(np.vstack([q, motion]))
            q = motion[-1]
            pose += 1
    if task.requires_rates:
        rates = motion_rates(exploration.robot, exploration.cells, task, motions)
        slow = [rate.fault(exploration.robot, task) for rate in rates]
        if any(slow):
            cause = next(filter(None, slow))
            pose = first + slow.index(cause)
    return f"{place_words(search.places, pose)}: {cause}" if cause else ""


def _words(search: PassSearch) -> str:
    """Why tracking has just stopped."""
    code, joint = (int(value) for value in search.exploration.work.stop_reason)
    names = search.exploration.robot.joint_names
    if code == stop.LIMIT:
        return f"{names[joint] if 0 <= joint < len(names) else 'a joint'} comes to its limit"
    if code == stop.COLLISION:
        known = search.pairs[joint : joint + 1] if joint >= 0 else ()
        bodies = next((f"{pair.first} and {pair.second}" for pair in known), "bodies")
        return f"{bodies} come too near to each other"
    return WORDS.get(code, "no motion is found")


@dataclass(frozen=True, slots=True)
class Gap:
    """Places of passes in a row on which no run works."""

    stretches: tuple[int, ...]
    """Which stretches they are on, in order."""
    length: float
    """m, of passes."""
    cause: str
    """Why, at the first of these places that is not reached."""
    proved: bool
    """Is that proved?"""


def gaps_of(search: PassSearch, pieces: Array, worked: Mask) -> tuple[Gap, ...]:
    """What is left out, in order: `pieces` (N - 1,) m between poses on which no run has worked."""
    exploration, left = search.exploration, (pieces > 0.0) & ~worked
    # What lies between two passes belongs to the gap if it is not worked on either.
    ends = np.flatnonzero(np.diff(np.concatenate([[False], ~worked, [False]])))
    found = []
    for first, last in ends.reshape(-1, 2).tolist():
        length = float(pieces[first:last][left[first:last]].sum())
        if length > 0.0:
            own = search.places.stretch[first:last][left[first:last]]
            stretches = tuple(dict.fromkeys(own.tolist()))
            missed = first + np.flatnonzero(~exploration.reached[first : last + 1])
            if len(missed):
                pose = int(missed[0])
                cause = search.slow.get(pose) or cause_of(exploration, pose, search.pairs)
                why, proved = f"{place_words(search.places, pose)}: {cause.detail}", cause.proved
            else:
                node = exploration.roadmap.over[first][-1]
                why, proved = where_it_stops(search, first, exploration.roadmap.q[node]), False
            found.append(Gap(stretches, length, why, proved))
    return tuple(found)


def along_stretch(places: PassPlaces, pose: int) -> float:
    """m, from the beginning of the stretch that a pose belongs to."""
    first = int(np.flatnonzero(places.stretch == places.stretch[pose])[0])
    return float(np.linalg.norm(np.diff(places.points[first : pose + 1], axis=0), axis=1).sum())


def place_words(places: PassPlaces, pose: int) -> str:
    """Where a pose is on the passes."""
    stretch = int(places.stretch[pose])
    if stretch < 0:
        return "on the way to the next pass"
    return f"{1e3 * along_stretch(places, pose):.0f} mm along stretch {stretch + 1}"
