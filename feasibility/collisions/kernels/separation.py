"""A certified lower bound on the distance of two convex bodies.

Every unit direction n is a certificate: body B lies beyond body A by at least

    s(n) = min n.b - max n.a,

and the largest s(n) is their distance (the least depth, negative, where they overlap). The
algorithm of Gilbert, Johnson and Keerthi (1988) only proposes the directions, from A towards B; the
bound is what the vertices themselves say of the best one. So neither rounding nor a loop that ends
too soon can make it too large; they only weaken it.

Bodies that were nearest at some vertices are mostly nearest there again after a small step: the
loop begins with these, and one direction is enough then.
"""

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.simplex import WEIGHT, WIDTH, reduce

MOST_TURNS = np.int64(40)
FEW_TURNS = np.int64(6)  # for a box, which can be opened instead
COARSE = 0.1  # relative gap at which a bound that is large enough already is good enough
FINE = 1e-6  # the same for others
FARTHEST = 1e300  # m, above any distance
TOUCHING = 1e-10  # m, nearer than this there is no direction to be had
# Places in the working memory, after the simplex: the best direction (before: the first to try),
# the shortest difference, its length, and how many points the simplex has.
BEST, SHORTEST = T.SIMPLEX + 4 * WIDTH, T.SIMPLEX + 5 * WIDTH
UPPER, POINTS = T.SIMPLEX + 6 * WIDTH, T.SIMPLEX + 6 * WIDTH + 1
# Columns of a point of the simplex, behind its weight: places of both vertices, and the pose.
ON_A, ON_B, IN_POSE = WEIGHT + 1, WEIGHT + 2, WEIGHT + 3
NOT_KNOWN = np.int64(0)  # instead of a row of `directions`


@kernel
def support(m, body, x, y, z):
    """The vertex of a body that is furthest along a direction, and how far it is.

    Every other vertex is compared with a most of its own, which the processor does side by side;
    and without branches, since nobody can guess which is the next most.
    """
    first, last = int(m[body + T.FIRST]), int(m[body + T.LAST])
    best, most, other, more = first, -np.inf, first, -np.inf
    for k in range(first, last - 3, 6):
        along, beside = m[k] * x + m[k + 1] * y, m[k + 3] * x + m[k + 4] * y
        along, beside = along + m[k + 2] * z, beside + m[k + 5] * z
        best = k if along > most else best
        most = along if along > most else most
        other = k + 3 if beside > more else other
        more = beside if beside > more else more
    if (last - first) % 2 == 1:
        along = m[last - 3] * x + m[last - 2] * y + m[last - 1] * z
        if along > most:
            best, most = last - 3, along
    return (other, more) if more > most else (best, most)


@kernel
def add_point(m, a, b, pose, size):
    """Add the difference of vertex b, placed by a pose, and vertex a to the simplex.

    Returns False where it is in there already.
    """
    new = T.SIMPLEX + WIDTH * size
    x, y, z = m[b], m[b + 1], m[b + 2]
    for k in range(3):
        turn = pose + 3 * k
        place = m[turn] * x + m[turn + 1] * y + m[turn + 2] * z + m[pose + 9 + k]
        m[new + k] = place - m[a + k]
        m[new + 3 + k] = m[a + k]
    m[new + ON_A], m[new + ON_B], m[new + IN_POSE] = a, b, 0.0 if pose == T.RELATIVE else 1.0
    for old in range(T.SIMPLEX, new, WIDTH):
        if m[old] == m[new] and m[old + 1] == m[new + 1] and m[old + 2] == m[new + 2]:
            return False
    return True


@kernel
def shortest(m, size):
    """Set SHORTEST from the weights; its length."""
    square = 0.0
    for k in range(3):
        value = 0.0
        for i in range(T.SIMPLEX, T.SIMPLEX + WIDTH * size, WIDTH):
            value += m[i + WEIGHT] * m[i + k]
        m[SHORTEST + k] = value
        square += value * value
    return np.sqrt(square)


@kernel
def recall(m, known, ends):
    """Set the simplex to the vertices at which two bodies were nearest; how many points it has.

    0 where none are known, or the bodies overlap in them.
    """
    size = 0
    for point in range(np.int64(m[known + T.KNOWN])):
        at = known + T.CORNERS + 3 * point
        pose = T.RELATIVE + 12 if ends == 2 and m[at + 2] > 0.0 else T.RELATIVE
        if add_point(m, np.int64(m[at]), np.int64(m[at + 1]), pose, size):
            size += 1
    return reduce(m, size) if size > 0 else 0


@kernel
def remember(m, known, bound):
    """Keep at which vertices two bodies are nearest, where the last `separation` found that."""
    points = np.int64(m[POINTS])
    found = points < 4 and m[UPPER] - bound <= COARSE * m[UPPER]
    m[known + T.KNOWN] = points if found else 0.0
    for point in range(points if found else 0):
        for column in range(3):
            row = T.SIMPLEX + WIDTH * point
            m[known + T.CORNERS + 3 * point + column] = m[row + ON_A + column]


@kernel
def separation(m, a, b, ends, need, want, least, turns, known):
    """Lower bound of the distance of two hulls of vertices, m, by at most `turns` directions.

    Args:
        m: the memory. Its place BEST holds the direction to begin with, of any length, and gets the
            best one; witness points are left in the simplex.
        a, b: the bodies, rows with FIRST and LAST; B stands in the poses RELATIVE.
        ends: 1, or 2 for the hull of B in both poses.
        need: m, a bound of at least this is enough: it is made sharper by a few more directions.
        want: m, nor are these tried once the bound has reached this.
        least: m, the bound is given up where the distance is less than this.
        turns: directions that are tried at most.
        known: the row of `directions` with the vertices to begin with; or NOT_KNOWN.
    """
    nx, ny, nz = m[BEST], m[BEST + 1], m[BEST + 2]
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if not length > 0.0:
        nx, length = 1.0, 1.0
    nx, ny, nz = nx / length, ny / length, nz / length
    lower, upper, size = -np.inf, FARTHEST, 0
    if known > 0:
        size = recall(m, known, ends)
        upper = shortest(m, size)
        if size > 0 and upper > TOUCHING:
            nx, ny, nz = m[SHORTEST] / upper, m[SHORTEST + 1] / upper, m[SHORTEST + 2] / upper
        else:
            upper, size = FARTHEST, 0
    for turn in range(turns):
        i, top = support(m, a, nx, ny, nz)
        j, bottom, pose = i, np.inf, int(T.RELATIVE)
        for p in range(T.RELATIVE, T.RELATIVE + 12 * ends, 12):
            x = -(m[p] * nx + m[p + 3] * ny + m[p + 6] * nz)
            y = -(m[p + 1] * nx + m[p + 4] * ny + m[p + 7] * nz)
            z = -(m[p + 2] * nx + m[p + 5] * ny + m[p + 8] * nz)
            k, along = support(m, b, x, y, z)
            value = m[p + 9] * nx + m[p + 10] * ny + m[p + 11] * nz - along
            if value < bottom:
                j, bottom, pose = k, value, p
        if bottom - top > lower:
            lower = bottom - top
            m[BEST], m[BEST + 1], m[BEST + 2] = nx, ny, nz
        gap = COARSE if lower >= need else FINE
        if lower >= want or upper - lower <= gap * upper or turn + 1 == turns:
            break
        if not add_point(m, i, j, pose, size):
            break
        size = reduce(m, size + 1)
        before, upper = upper, shortest(m, size)
        if size == 4:
            upper = 0.0  # the origin is inside: they overlap
        if upper < least or not TOUCHING < upper < before:
            break
        nx, ny, nz = m[SHORTEST] / upper, m[SHORTEST + 1] / upper, m[SHORTEST + 2] / upper
    m[UPPER], m[POINTS] = upper, size
    return lower
