"""What of passes is left out by all runs, and why."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.collisions.problem_bodies import Pair
from feasibility.roadmap.causes.diagnosis import cause_of
from feasibility.roadmap.exploration import Exploration
from feasibility.runs.stopping import where_it_stops
from feasibility.task import Task
from feasibility.verdict import Cause
from surfaces.passes.toolpath import PassPlaces


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


def gaps_of(
    exploration: Exploration,
    task: Task,
    places: PassPlaces,
    pieces: Array,
    worked: Mask,
    pairs: tuple[Pair, ...],
    slow: Mapping[int, Cause],
) -> tuple[Gap, ...]:
    """What is left out, in order.

    Args:
        exploration, task, places: a finished search, its task, the poses of the passes.
        pieces: (N - 1,) m, of passes between poses.
        worked: (N - 1,) on which of them a run works.
        pairs: of bodies that had to stay clear of each other.
        slow: poses to which no motion leads at the required speed and singular values.
    """
    left = (pieces > 0.0) & ~worked
    # What lies between two passes belongs to the gap if it is not worked on either.
    open_ = ~worked
    ends = np.flatnonzero(np.diff(np.concatenate([[0], open_.astype(np.int8), [0]])))
    found = []
    for first, last in ends.reshape(-1, 2).tolist():
        length = float(pieces[first:last][left[first:last]].sum())
        if length > 0.0:
            own = places.stretch[first : last + 1][np.append(left[first:last], False)]
            stretches = tuple(dict.fromkeys(own.tolist()))
            poses = range(first, last + 1)
            cause, proved = _why(exploration, task, places, poses, pairs, slow)
            found.append(Gap(stretches, length, cause, proved))
    return tuple(found)


def _why(
    exploration: Exploration,
    task: Task,
    places: PassPlaces,
    poses: range,
    pairs: tuple[Pair, ...],
    slow: Mapping[int, Cause],
) -> tuple[str, bool]:
    """Why the first of some poses is not reached, and whether that is proved."""
    for pose in poses:
        if not exploration.reached[pose]:
            cause = slow.get(pose) or cause_of(exploration, pose, pairs)
            return f"{place_words(places, pose)}: {cause.detail}", cause.proved
    node = exploration.roadmap.over[poses[0]][-1]
    stop = where_it_stops(exploration, task, poses[0], exploration.roadmap.q[node], pairs)
    if not stop.cause:
        return "", False
    return f"{place_words(places, stop.pose)}: {stop.cause}", False


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
