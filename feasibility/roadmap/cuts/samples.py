"""Points of the motion set: configurations that hold the tool on the surface, found by Newton.

Nothing that is proved rests on them. They show where a cut cannot be, and give the search motions
that it does not know.
"""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array
from feasibility.compiled import kernel
from feasibility.roadmap.branch_and_bound import Places, unturned
from feasibility.roadmap.cuts.regions import Region
from feasibility.roadmap.motions import (
    NEXT,
    PROJECTION_SLACK,
    SearchArrays,
    Work,
    place,
    project,
    stand_still,
)

NEWTON_STEPS = np.int64(16)  # of a try: most that succeed need fewer, and the rest are many


@kernel
def _project_rows(arrays, work, targets, q, enough, hit):  # type: ignore[no-untyped-def]
    """Project rows of q (k, n), in place, onto the targets (k, 9), until there are enough hits."""
    hits = 0
    for i in range(q.shape[0]):
        for k in range(3):
            work.target[0, k], work.target[1, k] = targets[i, k], targets[i, 3 + k]
        if arrays.roll[1] < np.inf:
            unturned(work.target, targets[i, 6:], arrays.roll[0])
        stand_still(arrays, work)
        place(arrays, work, NEXT, q[i])
        for j in range(q.shape[1]):
            work.secondary_step[j] = 0.0
        hit[i] = project(arrays, work, q[i], PROJECTION_SLACK, np.inf, NEWTON_STEPS)
        hits += hit[i]
        if hits == enough:
            return


def projected(
    arrays: SearchArrays,
    work: Work,
    region: Region,
    targets: Array,
    enough: int,
    rng: np.random.Generator,
) -> Array:
    """Random configurations of a region, projected onto targets, one each.

    Args:
        arrays, work: of the search.
        region: one turn of it takes the place of the limits; what its slabs leave out is dropped.
        targets: (k, 9) as `Places.centre`.
        enough: hits after which no more are tried.
        rng: draws the guesses.

    Returns:
        (hits, n) configurations.
    """
    box = region.over_one_turn()
    inside = arrays._replace(lower=box.low, upper=box.high)
    q = rng.uniform(box.low, box.high, (len(targets), len(box.low)))
    hit = np.zeros(len(targets), dtype=np.bool_)
    _project_rows(inside, work, np.ascontiguousarray(targets), q, enough, hit)
    q = q[hit]
    return q[region.inside(q)]


def random_targets(places: Places, k: int, rng: np.random.Generator) -> Array:
    """(k, 9) targets at random places of the surface, up to the radius of the finest parts."""
    finest = np.flatnonzero(places.children[:, 0] < 0)
    part = rng.choice(finest, k)
    x = rng.uniform(-1.0, 1.0, (k, 2, 1))
    targets = places.centre[part] + (x * places.slopes[part]).sum(axis=1)
    targets[:, 3:6] /= np.linalg.norm(targets[:, 3:6], axis=1)[:, None]
    return targets
