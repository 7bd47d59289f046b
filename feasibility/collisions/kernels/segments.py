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

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.distances import of_item
from feasibility.collisions.kernels.link_frames import (
    bound_levers,
    chord_deviation,
    place_bodies,
    pose_of,
    transformed,
)
from feasibility.collisions.kernels.tables import row, rows_of

ROUNDING = 1e-8  # m, taken off every bound for what rounding does to poses and levers
AHEAD = 8.0  # segments of this length that a bound may serve, if it is cheap to have
LEAST_AHEAD = 0.02  # m
PARTS = 4  # into which a segment may be cut
# Slots of the ends of a part, typed so that kernels are compiled once.
PART_START, PART_END = np.int64(2), np.int64(3)
START, END = np.int64(0), np.int64(1)


@kernel
def same(m, slot, end):
    """Does a slot hold a configuration that is asked for, bit by bit?"""
    held, asked = row(m, T.CONFIGURATIONS, slot), row(m, T.ASKED, end)
    equal = m[T.STATE + T.VALID + slot] > 0.0
    for j in range(rows_of(m, T.JOINTS)):
        equal &= m[held + j] == m[asked + j]
    return equal


@kernel
def settle_in(m, slot, end):
    """Let slot 0 or 1 hold a configuration that is asked for; nothing is known of it yet."""
    held, asked = row(m, T.CONFIGURATIONS, slot), row(m, T.ASKED, end)
    for j in range(rows_of(m, T.JOINTS)):
        m[held + j] = m[asked + j]
    for k in range(rows_of(m, T.ITEMS)):
        m[row(m, T.ITEMS, k) + T.BOUND + slot] = -np.inf
    m[T.STATE + T.VALID + slot] = 1.0
    place_bodies(m, slot)


@kernel
def slot_of_start(m):
    """The slot that holds the first configuration asked for; put there if none does."""
    if same(m, START, START):
        return START
    if same(m, END, START):
        return END
    slot = END if same(m, START, END) else START
    settle_in(m, slot, START)
    return slot


@kernel
def between_capsules(m, a, b, slot):
    """Lower bound of the distance of two groups by their capsules in a slot.

    The closest points of both axes (Ericson 2005, 5.1.9) propose a direction; it is the ends
    of the axes that certify it.
    """
    pose_a = pose_of(m, slot, np.int64(m[a + T.JOINT]))
    pose_b = pose_of(m, slot, np.int64(m[b + T.JOINT]))
    px, py, pz = transformed(m, pose_a, a + T.END_0)
    ux, uy, uz = transformed(m, pose_a, a + T.END_1)
    qx, qy, qz = transformed(m, pose_b, b + T.END_0)
    vx, vy, vz = transformed(m, pose_b, b + T.END_1)
    ux, uy, uz = ux - px, uy - py, uz - pz
    vx, vy, vz = vx - qx, vy - qy, vz - qz
    wx, wy, wz = px - qx, py - qy, pz - qz
    uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    uv, uw = ux * vx + uy * vy + uz * vz, ux * wx + uy * wy + uz * wz
    vw = vx * wx + vy * wy + vz * wz
    crossed = uu * vv - uv * uv
    s = min(max((uv * vw - uw * vv) / crossed, 0.0), 1.0) if crossed > 0.0 else 0.0
    r = min(max((uv * s + vw) / vv, 0.0), 1.0) if vv > 0.0 else 0.0
    if uu > 0.0:
        s = min(max((uv * r - uw) / uu, 0.0), 1.0)
    nx, ny, nz = vx * r - ux * s - wx, vy * r - uy * s - wy, vz * r - uz * s - wz
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if not length > 0.0:
        return -np.inf
    along = -(nx * wx + ny * wy + nz * wz)
    along -= max(nx * ux + ny * uy + nz * uz, 0.0)
    along += min(nx * vx + ny * vy + nz * vz, 0.0)
    return along / length - m[a + T.THICKNESS] - m[b + T.THICKNESS]


@kernel
def cheap_bound(m, item, slot):
    """Raise an item's bound in a slot by capsules, where both are groups."""
    if m[item + T.TREE] < 0.0:
        bound = between_capsules(
            m, np.int64(m[item + T.ITEM_A]), np.int64(m[item + T.ITEM_B]), slot
        )
        m[item + T.BOUND + slot] = max(m[item + T.BOUND + slot], bound)


@kernel
def by_budget(m, item, here, there, most, need):
    """Do the bounds of both ends decide? Raises that of the further end."""
    start, end = item + T.BOUND + here, item + T.BOUND + there
    m[end] = max(m[end], m[start] - most)
    return m[start] - most >= need or m[start] + m[end] - most >= 2.0 * need


@kernel
def swept(m, item, here, there, most, need):
    """Bound of the swept hull between two slots, less delta; -inf where it is less than needed."""
    group, inner = np.int64(m[item + T.ITEM_B]), np.int64(m[item + T.INNER])
    less = need + chord_deviation(m, group, inner, here, there)
    ahead = max(AHEAD * most, LEAST_AHEAD)
    if m[item + T.TREE] >= 0.0 and here < PART_START and m[item + T.BOUND + here] > -np.inf:
        spare = m[item + T.BOUND + here] - need
        ahead = min(ahead, 2.0 * spare) if spare > 0.5 * most else 0.0
    bound = of_item(m, item, here, there, less, less + ahead, less)
    return bound - (less - need) if bound >= less else -np.inf


@kernel
def holds_in_parts(m, item, here, there, need):
    """Is an item certified on every part of a segment, whose end is not too near?

    The last part is first: a segment that runs into something does so at its end. Slots 2 and 3
    hold the ends of a part.
    """
    group = np.int64(m[item + T.ITEM_B])
    if here == there or not of_item(m, item, there, there, need, need, need) >= need:
        return False
    q0, q1 = row(m, T.CONFIGURATIONS, here), row(m, T.CONFIGURATIONS, there)
    low_q, high_q = row(m, T.CONFIGURATIONS, PART_START), row(m, T.CONFIGURATIONS, PART_END)
    high, size = PARTS, PARTS // 2
    while high > 0:
        for j in range(rows_of(m, T.JOINTS)):
            whole = m[q1 + j] - m[q0 + j]
            m[low_q + j] = m[q0 + j] + whole * (high - size) / PARTS
            m[high_q + j] = m[q0 + j] + whole * high / PARTS
        place_bodies(m, PART_START)
        place_bodies(m, PART_END)
        bound_levers(m, group, PART_START, PART_END)
        if swept(m, item, PART_START, PART_END, 0.0, need) >= need:
            high -= size
            size = 2 if high % 2 == 0 else 1
        elif size == 1:
            return False
        else:
            size //= 2
    bound_levers(m, group, here, there)
    return True


@kernel
def item_holds(m, item, here, there):
    """Is an item clear on the segment between slots `here` and `there` (0 and 1, or one twice)?"""
    need, group = m[item + T.CLEARANCE] + ROUNDING, np.int64(m[item + T.ITEM_B])
    most = m[row(m, T.REACH, np.int64(m[group + T.NUMBER])) + np.int64(m[item + T.INNER])]
    if by_budget(m, item, here, there, most, need):
        return True
    cheap_bound(m, item, here)
    cheap_bound(m, item, there)
    if by_budget(m, item, here, there, most, need):
        return True
    bound = swept(m, item, here, there, most, need)
    if not (bound >= need or holds_in_parts(m, item, here, there, need)):
        return False
    start, end = item + T.BOUND + here, item + T.BOUND + there
    m[start], m[end] = max(m[start], bound), max(m[end], bound, need)
    return True


@kernel
def segment_holds_clear(m):
    """How far the end of the segment in `asked` is sure to exceed what every pair needs, m.

    At most 0 where the segment is not certified. The item that was to blame the last time is asked
    first: a step that was refused is tried again, shorter.
    """
    start, end = row(m, T.ASKED, START), row(m, T.ASKED, END)
    finite, moves = True, False
    for j in range(rows_of(m, T.JOINTS)):
        finite &= abs(m[start + j]) + abs(m[end + j]) < np.inf
        moves |= m[start + j] != m[end + j]
    if not finite:
        return -1.0
    here = slot_of_start(m)
    there = 1 - here if moves else here
    if moves and not same(m, there, END):
        settle_in(m, there, END)
    for b in range(rows_of(m, T.GROUPS)):
        bound_levers(m, row(m, T.GROUPS, b), here, there)
    items, first, least = rows_of(m, T.ITEMS), np.int64(m[T.STATE + T.FIRST_ASKED]), np.inf
    for k in range(items):
        item = row(m, T.ITEMS, (first + k) % items)
        if not item_holds(m, item, here, there):
            m[T.STATE + T.FIRST_ASKED], m[T.STATE + T.BLAMED] = (
                (first + k) % items,
                m[item + T.PAIR],
            )
            return -1.0
        least = min(least, m[item + T.BOUND + there] - m[item + T.CLEARANCE])
    return max(least, ROUNDING)
