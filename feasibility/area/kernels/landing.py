"""Landing on tiles: the arm follows lines of places in certified steps, and tiles are tested.

Each line starts at a configuration that is joined to the component. A step goes to the target over
the next place, by the search's projection, away from limits and boundaries where the arm is free;
it counts where the search's own bound shows that the straight joint segment keeps to tolerance,
cone and limits. Steps at rest only lead away from limits, and may be left out.
"""

from __future__ import annotations

import numpy as np

from feasibility.area.kernels.lemma import tile_holds
from feasibility.compiled import kernel, put
from feasibility.roadmap.motions import (
    CONE_SLACK,
    HERE,
    NEWTON_STEPS,
    NEXT,
    accept,
    copy_slot,
    linearise,
    margin_objective,
    place,
    project,
    segment_holds,
    stand_still,
)

UNREACHED = 4  # a code beside those of `tile_holds`
UNKNOWN = 4.0  # [1] of the tolerance: a step that failed is tried at half of its length
INNER = 0.25  # [1] of the cone's chord, within which the axis is led if that is possible
AT_REST = 0.3  # rad, the most that a step at rest moves at first
LEAST_PUSH = 0.02  # rad, of a step
NO_PUSH = 0.0


@kernel
def aim_at(work, target):  # type: ignore[no-untyped-def]
    """Set `work.target` from a row (2, 3) of point and approach direction."""
    for k in range(3):
        work.target[0, k] = target[0, k]
        work.target[1, k] = target[1, k]


@kernel
def allow(arrays, work, bound):  # type: ignore[no-untyped-def]
    """Bounds and allowances of a step; `bound` (2,) bounds the second derivatives of its target.

    See `PlacePaths.derivative_bounds`.

    The places are known all along, so nothing is lost to matching them again; and the cone is asked
    for at the target.
    """
    stand_still(arrays, work)
    work.derivative_bound[0] = bound[0]
    work.derivative_bound[1] = bound[1]
    work.derivative_bound[2] = 0.0
    work.derivative_bound[3] = np.inf
    work.derivative_bound[4] = np.inf


@kernel
def step_to(arrays, work, q, target, bound, size, inner):  # type: ignore[no-untyped-def]
    """One certified step from q (slot 0) to a target; the result is in `work.trial`, slot 1.

    Args:
        arrays, work: the `SearchArrays` and the `Work`.
        q: (n,) rad or m.
        target: (2, 3) see `aim_at`.
        bound: (2,) see `allow`.
        size: rad, how far the arm may move away from limits and boundaries.
        inner: 1, what the projection may use of the cone's chord.

    Returns:
        The shares of tolerance and cone that the step uses, as `segment_holds` does; inf where the
        projection failed.
    """
    allow(arrays, work, bound)
    aim_at(work, target)
    copy_slot(arrays, work)
    linearise(arrays, work, NEXT)
    margin_objective(arrays, work, q, size)
    put(work.trial, q)
    slack = CONE_SLACK * min(1.0, size)
    whole = work.allowance[1]
    work.allowance[1] = min(whole, inner)
    good = project(arrays, work, work.trial, slack, work.error[HERE, 1], NEWTON_STEPS)
    work.allowance[1] = whole
    if not good:
        return np.inf, np.inf
    return segment_holds(arrays, work, q, work.trial)


@kernel
def certified_step(arrays, work, q, target, bound, size):  # type: ignore[no-untyped-def]
    """`step_to` with the axis led inwards, or else without: a tile's turn needs most of the cone.

    Inwards by as much as the step moves the arm anyway, for it has to be short.
    """
    inner = max(INNER * arrays.cone_chord, work.error[HERE, 1] - size)
    position, cone = step_to(arrays, work, q, target, bound, size, inner)
    if not (position <= 1.0 and cone <= 1.0):
        position, cone = step_to(arrays, work, q, target, bound, NO_PUSH, np.inf)
    return position, cone


@kernel
def follow(arrays, work, q, targets, bounds, first, last, path):  # type: ignore[no-untyped-def]
    """Follow the places first..last of a line from q (in place) over the first one.

    Args:
        arrays, work: the `SearchArrays` and the `Work`.
        q: (n,) rad or m.
        targets: (m, 2, 3) target points (m) and approach directions of places.
        bounds: (m, 2) of the piece that ends at each, see `PlacePaths.derivative_bounds`.
        first, last: rows.
        path: (m, n) receives the configurations over the places.

    Returns:
        0 where the last place was reached; inf where no solution over it was found; else the share
        of the tolerance that a step would use, over 1, or UNKNOWN, and shorter steps may do.
    """
    aim_at(work, targets[first])
    place(arrays, work, HERE, q)
    put(path[first], q)
    at_rest = AT_REST
    for row in range(first + 1, last + 1):
        span = 0.0
        for k in range(3):
            span += (targets[row, 0, k] - targets[row - 1, 0, k]) ** 2
        span = 2.0 * np.sqrt(span) / arrays.scale
        size = max(span, LEAST_PUSH) if span > 0.0 else at_rest
        position, cone = certified_step(arrays, work, q, targets[row], bounds[row], size)
        if position <= 1.0 and cone <= 1.0:
            put(q, work.trial)
            accept(work)
        elif span > 0.0 and row == last and not position < np.inf:
            return np.inf
        elif span > 0.0:
            return min(position, UNKNOWN) if position > 1.0 else UNKNOWN
        else:
            at_rest *= 0.5
        put(path[row], q)
    return 0.0


@kernel
def land(  # type: ignore[no-untyped-def]
    arrays, work, tile, targets, bounds, first, path, corners, radii, gains, results, budget
):
    """Follow lines to the middles of tiles, and test these.

    Args:
        arrays, work, tile: the `SearchArrays`, the `Work`, and the `Tile` as working memory.
        targets, bounds: see `follow`, line by line.
        first: (k + 1,) where each line begins.
        path: (m, n) holds at each line's beginning where it starts; receives the rest.
        corners, radii: (k, 4, 2, 3) and (k, 2) of each tile, see `Tile`.
        gains: (k, n, 3) receives the G of each.
        results: (k, 2) receives a code of `tile_holds`, or UNREACHED; and what `follow` says.
        budget: evaluations of the arm, after which the rest is left as UNREACHED.
    """
    q = tile.here
    stop = work.counts[0] + budget
    for k in range(first.shape[0] - 1):
        results[k, 0], results[k, 1] = UNREACHED, np.inf
        if work.counts[0] > stop:
            continue
        put(q, path[first[k]])
        results[k, 1] = follow(arrays, work, q, targets, bounds, first[k], first[k + 1] - 1, path)
        if results[k, 1] > 0.0:
            continue
        for part in range(2):
            tile.radii[part] = radii[k, part]
            for c in range(4):
                for i in range(3):
                    tile.corners[c, part, i] = corners[k, c, part, i]
        results[k, 0] = tile_holds(arrays, work, tile, q)
        for j in range(q.shape[0]):
            put(gains[k, j], tile.gain[j])
