"""The order in which a path visits cells: rows, columns, a spiral, the shortest that was found, or
the one in which poses are given.

Only cells and the steps between them are known here, nothing of an arm. A step between two cells
that touch costs the distance of their centres; cells that do not touch are joined by the shortest
path over others, which are then visited again.

Orders are shortened by 2-opt and Or-opt on an open path, until nothing improves: G. A. Croes, A
method for solving traveling-salesman problems, Operations Research 6 (1958); I. Or, Traveling
salesman-type combinatorial problems (1976).
"""

from typing import Literal, get_args

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from coverable.arrays import Array, Ints
from coverable.errors import CoverableError
from surfaces.cells import Cells

Order = Literal["rows", "columns", "spiral", "shortest", "given"]
POSES = "poses"  # the kind of surface that has an order of its own
GRID_ORDERS: tuple[Order, ...] = ("rows", "columns", "spiral")

MOST_IMPROVED = 600  # cells up to which an order is improved; it takes their cube
MOST_CANDIDATES = 2  # orders that are improved, the shortest first
LONGEST_PART = 3  # places that Or-opt moves at once
GAIN = 1e-9  # [1], share of the whole length that a change must gain
MOST_SWEEPS = 200
TIE = 1e-9  # [1], share of a length below which two lengths are alike


class PathError(CoverableError):
    """A path or a trajectory that cannot be made: why, and what can be done instead."""


def grid_order(
    order: Order,
    rows: int,
    columns: int,
    begin: tuple[int, int] = (0, 0),
    flipped: tuple[bool, bool] = (False, False),
) -> Ints:
    """Flat indices of rows x columns cells in the order of a path.

    Args:
        order: see `coverage_path`.
        rows, columns: how many there are.
        begin: row and column that count as the first ones, where a grid closes on itself.
        flipped: whether rows, and whether columns, are taken from the last to the first.

    Example:
        >>> grid_order("rows", 2, 3).tolist(), grid_order("columns", 2, 3).tolist()
        ([0, 1, 2, 5, 4, 3], [0, 3, 4, 1, 2, 5])
        >>> grid_order("spiral", 3, 3).tolist()
        [0, 1, 2, 5, 8, 7, 6, 3, 4]
        >>> grid_order("rows", 1, 4, begin=(0, 1)).tolist()
        [1, 2, 3, 0]
    """
    table = np.arange(rows * columns, dtype=np.int64).reshape(rows, columns)
    table = np.roll(table, (-begin[0], -begin[1]), axis=(0, 1))
    table = table[:: -1 if flipped[0] else 1, :: -1 if flipped[1] else 1]
    if order == "spiral":
        parts = []
        while table.size:
            parts.append(table[0])
            table = np.rot90(table[1:])
        return np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)
    if order == "columns":
        table = table.T
    snake = table.copy()
    snake[1::2] = table[1::2, ::-1]
    return snake.reshape(-1)


def closed_sides(cells: Cells) -> tuple[bool, bool]:
    """Whether the last row of a grid touches the first one all along; and the columns too.

    Example:
        >>> from coverable import cylinder
        >>> closed_sides(cylinder(0.5, (0, 360), (0, 1)).cells(6, 3))
        (True, False)
    """
    rows, columns = int(cells.shape[0]), int(cells.shape[1])
    table = np.arange(len(cells)).reshape(rows, columns)
    steps = step_lengths(cells, cells.pairs)
    return (
        rows > 2 and bool(np.all(steps[table[0], table[-1]] > 0.0)),
        columns > 2 and bool(np.all(steps[table[:, 0], table[:, -1]] > 0.0)),
    )


def check_order(order: str, kind: str, grid: bool, in_order: bool = False) -> None:
    """Refuse an order that cells do not have, before anything is searched for.

    Of the cells it counts of which kind their surface is, whether they lie in rows and columns, and
    whether they are a toolpath.

    Raises:
        PathError: there is no such order, or these cells do not have it.
    """
    if order not in get_args(Order):
        names = ", ".join(get_args(Order))
        raise PathError(f"there is no order {order!r}; the orders are {names}")
    if in_order and order != "given":
        raise PathError(
            f"a toolpath is run in its order, 'given', not {order!r}; to visit its poses in "
            "another, give them a radius as neighbours"
        )
    if order in GRID_ORDERS and not grid:
        raise PathError(
            f"the order {order!r} follows the rows and columns of a grid, which the cells of a "
            f"{kind} surface are not; use order 'shortest'"
        )
    if order == "given" and kind != POSES:
        raise PathError(
            f"the order 'given' is that of a list of poses; the cells of a {kind} have none"
        )


def usual_order(cells: Cells) -> Order:
    """The default order."""
    if cells.in_order:
        return "given"
    return "rows" if len(cells.shape) == 2 else "shortest"


def shortest_order(cells: Cells, pairs: Ints | None = None) -> Ints:
    """(N,) the shortest order found: of a grid's and a greedy one the best, improved.

    Steps are possible between `pairs` (M, 2), by default the cells that touch.
    """
    steps = step_lengths(cells, cells.pairs if pairs is None else pairs)
    shape = tuple(map(int, cells.shape))
    grids = [grid_order(name, *shape) for name in GRID_ORDERS if len(shape) == 2]
    candidates = [*grids, _greedy(steps)]
    lengths = [route_length(steps, order) for order in candidates]
    best = candidates[int(np.argmin(lengths))]
    if not 3 <= len(best) <= MOST_IMPROVED:
        return best
    distance = dijkstra(steps)
    if not np.isfinite(distance).all():
        return best  # some cells cannot be reached from others; which, the caller will find
    alike = np.round(np.array(lengths) / min(lengths), 9)  # of equal ones the first
    promising = np.argsort(alike, kind="stable")[:MOST_CANDIDATES]
    tours = [improved(distance, candidates[k]) for k in promising]
    shortened = np.array([tour_length(distance, tour) for tour in tours])
    return tours[int(np.flatnonzero(shortened <= shortened.min() * (1.0 + TIE))[0])]


def step_lengths(cells: Cells, pairs: Ints) -> csr_array:
    """(N, N) symmetric: distance (m) of the centres of each pair, nothing elsewhere."""
    length = np.linalg.norm(cells.centres[pairs[:, 0]] - cells.centres[pairs[:, 1]], axis=1)
    length = np.maximum(length, np.finfo(float).tiny)  # a zero would be no step at all
    steps = csr_array((length, tuple(pairs.T)), shape=(len(cells), len(cells)))
    return csr_array(steps + steps.T)


def route_length(steps: csr_array, order: Ints) -> float:
    """m, length of the shortest path that visits cells in this order; inf where there is none."""
    if len(order) < 2:
        return 0.0
    direct = np.asarray(steps[order[:-1], order[1:]]).reshape(-1)
    total = float(direct.sum())
    for k in np.flatnonzero(direct == 0.0):
        total += float(dijkstra(steps, indices=int(order[k]))[order[k + 1]])
    return total


def _greedy(steps: csr_array) -> Ints:
    """An order that goes on to the unvisited neighbour with the fewest open ends, or the nearest.

    Corners are so not left behind (Warnsdorff's rule); from a dead end the nearest unvisited cell
    over visited ones comes next.
    """
    ends = np.split(steps.indices, steps.indptr[1:-1])
    left, here, found = np.ones(len(ends), dtype=bool), -1, list[int]()
    while left.any():
        near = ends[here][left[ends[here]]] if found else np.arange(len(ends))
        if len(near):
            open_ends = np.array([left[ends[k]].sum() for k in near])
            away = np.asarray(steps[[here], near]).reshape(-1) if found else open_ends
            here = int(near[np.lexsort((away, open_ends))[0]])
        else:
            away = np.where(left, dijkstra(steps, indices=here), np.inf)
            # Where no step leads any further, go on elsewhere: the caller reports it.
            here = int(np.argmin(away)) if np.isfinite(away).any() else int(np.argmax(left))
        found.append(here)
        left[here] = False
    return np.array(found, dtype=np.int64)


def tour_length(distance: Array, tour: Ints) -> float:
    """Length of an open path through places in this order."""
    return float(distance[tour[:-1], tour[1:]].sum())


def improved(distance: Array, tour: Ints) -> Ints:
    """A path that is no longer, and that no turn of a part and no move of a short part shortens.

    Of N places with symmetric distances (N, N); the path may begin and end anywhere.

    Example:
        >>> x = np.array([0.0, 1.0, 2.0, 3.0])
        >>> improved(np.abs(x[:, None] - x), np.array([0, 2, 1, 3])).tolist()
        [0, 1, 2, 3]
    """
    count = len(tour)
    gain = GAIN * max(tour_length(distance, tour), np.finfo(float).tiny)
    # Before the first place and behind the last one is a place that nothing is away from.
    away = np.pad(distance, (0, 1))
    path = np.pad(np.asarray(tour, dtype=np.int64), 1, constant_values=count)
    for _ in range(MOST_SWEEPS):
        before = path.copy()
        for i in range(1, count):
            _turn(away, path, i, gain)
        for size in range(1, min(LONGEST_PART, count - 2) + 1):
            for i in range(1, count - size + 2):
                path = _moved(away, path, i, size, gain)
        if (path == before).all():
            break
    return path[1:-1]


def _turn(away: Array, path: Ints, i: int, gain: float) -> None:
    """Turn round the places i .. j of a path for each j in turn that gains."""
    j = i
    while True:
        last, behind = path[j + 1 : -1], path[j + 2 :]
        more = away[path[i - 1], last] + away[path[i], behind]
        more -= away[path[i - 1], path[i]] + away[last, behind]
        gains = np.flatnonzero(more < -gain)
        if not len(gains):
            return
        j += 1 + int(gains[0])
        path[i : j + 1] = path[i : j + 1][::-1].copy()


def _moved(away: Array, path: Ints, i: int, size: int, gain: float) -> Ints:
    """The places i .. i + size - 1 put where that gains most, either way round."""
    part, rest = path[i : i + size], np.concatenate([path[:i], path[i + size :]])
    left, right = rest[:-1], rest[1:]
    ways = np.stack(
        [away[left, a] + away[b, right] for a, b in ((part[0], part[-1]), (part[-1], part[0]))]
    )
    ways -= away[left, right]
    turned, k = divmod(int(np.argmin(ways)), len(left))
    if ways[turned, k] >= ways[0, i - 1] - gain:
        return path
    return np.concatenate([rest[: k + 1], part[:: 1 - 2 * turned], rest[k + 1 :]])
