"""Is a straight segment in joint space clear of all pairs?

For each item, with M and delta of `link_frames.py`, d0 and d1 lower bounds of its distance at the
ends, and c what it needs, the cheapest first:

1. budget: d0 - M >= c, or both ends: d0 + d1 - M >= 2 c (Schwarzer, Saha and Latombe 2005);
2. the same after bounds by capsules;
3. swept hull: the hull of the body at both ends, seen from the other body, is c + delta from it;
4. the segment halved, at most twice, unless its end already is too near.

d0 - M, or what the swept hull is away, is the next segment's d0: a pair far apart costs one
subtraction a segment.
"""

from __future__ import annotations

import numpy as np

from feasibility.collisions.kernels.distances import of_item
from feasibility.collisions.kernels.link_frames import (
    chord_deviation,
    place_bodies,
    spread,
    transformed,
)
from feasibility.collisions.kernels.tables import (
    ASKED,
    BLAMED,
    BOUNDS,
    BY_BUDGET,
    CALLS,
    CLEARANCE,
    DECIDED,
    END_0,
    END_1,
    INNER,
    ITEM_A,
    ITEM_B,
    PAIR,
    SOUP,
    SWEPT,
    THICKNESS,
    VALID,
)
from feasibility.compiled import kernel

ROUNDING = 1e-8  # m, taken off every bound for what rounding does to poses and levers
AHEAD = 8.0  # segments of this length that a bound may serve, if it is cheap to have
LEAST_AHEAD = 0.02  # m
SMALLEST = 4  # part of a segment that is tried is one in this many


@kernel
def same(t, slot, row):  # type: ignore[no-untyped-def]
    """Does a slot hold a configuration that is asked for, bit by bit?"""
    if t.state[0, VALID + slot] == 0.0:
        return False
    equal = True
    for j in range(t.asked.shape[1]):
        equal &= t.configurations[slot, j] == t.asked[row, j]
    return equal


@kernel
def settle_in(t, slot, row):  # type: ignore[no-untyped-def]
    """Let slot 0 or 1 hold a configuration that is asked for; nothing is known of it yet."""
    for j in range(t.asked.shape[1]):
        t.configurations[slot, j] = t.asked[row, j]
    for item in range(t.items.shape[0]):
        t.bounds[slot, item] = -np.inf
    t.state[0, VALID + slot] = 1.0
    place_bodies(t, slot)


@kernel
def slot_of_start(t):  # type: ignore[no-untyped-def]
    """The slot that holds the first configuration asked for; put there if none does."""
    for slot in range(2):
        if same(t, slot, 0):
            return slot
    slot = 1 if same(t, 0, 1) else 0
    settle_in(t, slot, 0)
    return slot


@kernel
def between_capsules(t, a, b, root):  # type: ignore[no-untyped-def]
    """Lower bound of the distance of two groups by their capsules, with poses from row `root`.

    The closest points of both axes (Ericson 2005, 5.1.9) propose a direction; it is the ends
    of the axes that certify it.
    """
    first, second = t.groups[a], t.groups[b]
    pose_a, pose_b = t.poses[root + np.int64(first[0])], t.poses[root + np.int64(second[0])]
    px, py, pz = transformed(pose_a, first, END_0)
    ux, uy, uz = transformed(pose_a, first, END_1)
    qx, qy, qz = transformed(pose_b, second, END_0)
    vx, vy, vz = transformed(pose_b, second, END_1)
    ux, uy, uz = ux - px, uy - py, uz - pz
    vx, vy, vz = vx - qx, vy - qy, vz - qz
    wx, wy, wz = px - qx, py - qy, pz - qz
    aa, ee = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    bb, cc = ux * vx + uy * vy + uz * vz, ux * wx + uy * wy + uz * wz
    ff = vx * wx + vy * wy + vz * wz
    crossed = aa * ee - bb * bb
    s = min(max((bb * ff - cc * ee) / crossed, 0.0), 1.0) if crossed > 0.0 else 0.0
    r = (bb * s + ff) / ee if ee > 0.0 else 0.0
    if not 0.0 <= r <= 1.0:
        r = min(max(r, 0.0), 1.0)
    if aa > 0.0:
        s = min(max((bb * r - cc) / aa, 0.0), 1.0)
    nx, ny, nz = vx * r - ux * s - wx, vy * r - uy * s - wy, vz * r - uz * s - wz
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if not length > 0.0:
        return -np.inf
    along = -(nx * wx + ny * wy + nz * wz) / length
    along -= max((nx * ux + ny * uy + nz * uz) / length, 0.0)
    along += min((nx * vx + ny * vy + nz * vz) / length, 0.0)
    return along - first[THICKNESS] - second[THICKNESS]


@kernel
def cheap_bound(t, item, slot):  # type: ignore[no-untyped-def]
    """Raise an item's bound in a slot by capsules, where both are groups."""
    if t.items[item, SOUP] < 0.0:
        root = slot * (t.joints.shape[0] + 1)
        a, b = np.int64(t.items[item, ITEM_A]), np.int64(t.items[item, ITEM_B])
        t.bounds[slot, item] = max(t.bounds[slot, item], between_capsules(t, a, b, root))


@kernel
def by_budget(t, item, here, there, most, need):  # type: ignore[no-untyped-def]
    """Do the bounds of both ends decide? Raises that of the further end."""
    from_here = t.bounds[here, item] - most
    if t.bounds[there, item] < from_here:
        t.bounds[there, item] = from_here
    return from_here >= need or t.bounds[here, item] + t.bounds[there, item] - most >= 2.0 * need


@kernel
def swept(t, item, here, there, need):  # type: ignore[no-untyped-def]
    """Bound of the swept hull between two slots, less delta; -inf where it is less than needed."""
    b = np.int64(t.items[item, ITEM_B])
    inner = np.int64(t.items[item, INNER])
    delta = chord_deviation(t, b, inner, here, there)
    ahead = max(AHEAD * t.reach[b, inner], LEAST_AHEAD)
    t.state[0, SWEPT] += 1.0
    bound = of_item(t, item, here, there, need + delta, need + delta + ahead, need + delta)
    return bound - delta if bound >= need + delta else -np.inf


@kernel
def holds_in_parts(t, item, here, there, need):  # type: ignore[no-untyped-def]
    """Is an item certified on every part of a segment, whose end is not too near?

    The last part is first: a segment that runs into something does so at its end. Slots 2 and 3
    hold the ends of a part.
    """
    b = np.int64(t.items[item, ITEM_B])
    t.state[0, BOUNDS] += 1.0
    if here == there or not of_item(t, item, there, there, need, need, need) >= need:
        return False
    high, size = SMALLEST, SMALLEST // 2
    while high > 0:
        for j in range(t.joints.shape[0]):
            start, whole = t.configurations[here, j], t.configurations[there, j]
            whole -= start
            t.configurations[2, j] = start + whole * (high - size) / SMALLEST
            t.configurations[3, j] = start + whole * high / SMALLEST
        place_bodies(t, 2)
        place_bodies(t, 3)
        spread(t, b, 2, 3)
        if swept(t, item, 2, 3, need) >= need:
            high -= size
            size = max(size, 2 if high % 2 == 0 else 1)
        elif size == 1:
            return False
        else:
            size //= 2
    spread(t, b, here, there)
    return True


@kernel
def item_holds(t, item, here, there):  # type: ignore[no-untyped-def]
    """Is an item clear on the segment between slots `here` and `there` (0 and 1, or one twice)?"""
    t.state[0, DECIDED] += 1.0
    need = t.items[item, CLEARANCE] + ROUNDING
    most = t.reach[np.int64(t.items[item, ITEM_B]), np.int64(t.items[item, INNER])]
    if by_budget(t, item, here, there, most, need):
        t.state[0, BY_BUDGET] += 1.0
        return True
    cheap_bound(t, item, here)
    cheap_bound(t, item, there)
    if by_budget(t, item, here, there, most, need):
        return True
    bound = swept(t, item, here, there, need)
    if bound >= need:
        t.bounds[here, item] = max(t.bounds[here, item], bound)
        t.bounds[there, item] = max(t.bounds[there, item], bound)
        return True
    if not holds_in_parts(t, item, here, there, need):
        return False
    t.bounds[there, item] = max(t.bounds[there, item], need)
    return True


@kernel
def segment_holds_clear(t):  # type: ignore[no-untyped-def]
    """How far the segment in `asked` is sure to exceed what every pair needs, m; else at most 0.

    The item that was to blame the last time is asked first: a step that was refused is tried again.
    """
    t.state[0, CALLS] += 1.0
    for j in range(t.asked.shape[1]):
        if not abs(t.asked[0, j]) + abs(t.asked[1, j]) < np.inf:
            return -1.0
    here = slot_of_start(t)
    moves = False
    for j in range(t.asked.shape[1]):
        moves |= t.asked[0, j] != t.asked[1, j]
    there = 1 - here if moves else here
    if moves and not same(t, there, 1):
        settle_in(t, there, 1)
    for b in range(t.groups.shape[0]):
        spread(t, b, here, there)
    items = t.items.shape[0]
    first, least = np.int64(t.state[0, ASKED]), np.inf
    for k in range(items):
        item = (first + k) % items
        if not item_holds(t, item, here, there):
            t.state[0, ASKED], t.state[0, BLAMED] = item, t.items[item, PAIR]
            return -1.0
        least = min(least, t.bounds[there, item] - t.items[item, CLEARANCE])
    return max(least, ROUNDING)
