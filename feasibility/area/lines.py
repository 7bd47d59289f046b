"""Lines of places for the kernels: from nodes to the middles of tiles, in steps that can hold."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from coverable_arrays import Array, Ints, Mask
from feasibility.area.kernels import HOLDS, UNKNOWN, UNREACHED, Tile, land
from feasibility.area.nodes import HeldTiles, Nodes
from feasibility.roadmap.motions import SearchArrays, Work
from surfaces.cell_tiles import CellTiles, Lines, Tiles
from surfaces.places import Places

TRIES = 3  # of one line, with ever shorter steps
STEP = 0.02  # m, what is tried first
MOST_STEPS = 64  # of a line
AT_REST = 6  # steps over a cell's centre, away from limits
LONGER = 1e-9  # [1] of a piece: what rounding leaves of the others


@dataclass(frozen=True, eq=False, slots=True)
class Landed:
    """What came of lines to the middles of k tiles."""

    code: Ints
    """(k,) of `feasibility.area.kernels`."""
    node: Ints
    """(k,) the node over the middle; -1 where it was not reached."""
    gains: Array
    """(k, n, 3)"""

    @staticmethod
    def nowhere(count: int, n: int) -> Landed:
        """None reached."""
        gains = np.zeros((count, n, 3))
        return Landed(np.full(count, UNREACHED), np.full(count, -1), gains)

    @property
    def holds(self) -> Mask:
        """(k,)"""
        return np.asarray(self.code == HOLDS)

    def put(self, rows: Ints, found: Landed) -> None:
        """Replace some."""
        self.code[rows], self.node[rows] = found.code, found.node
        self.gains[rows] = found.gains


@dataclass(eq=False)
class Lander:
    """Lands on tiles, and keeps the nodes."""

    arrays: SearchArrays
    work: Work
    memory: Tile
    cut: CellTiles
    approach: Array | None
    """(3,) where the approach is one direction; None where it is along the normals."""
    budget: int
    """Evaluations of the arm in all."""
    lines: int = 0
    """Lines that were followed."""
    _nodes: list[Nodes] = field(default_factory=list)
    _count: int = 0

    @property
    def nodes(self) -> Nodes:
        """All of them."""
        self._nodes = [Nodes.join(*self._nodes)]
        return self._nodes[0]

    def add(self, nodes: Nodes) -> Ints:
        """Keep nodes; their numbers."""
        self._nodes.append(nodes)
        first, self._count = self._count, self._count + len(nodes.q)
        return np.arange(first, self._count)

    @property
    def evaluations(self) -> int:
        """Of the arm, so far."""
        return int(self.work.counts[0])

    @property
    def left(self) -> int:
        """Evaluations that the budget still has."""
        return self.budget - self.evaluations

    def points(self, places: Places) -> Array:
        """(k, 3) m, target points."""
        return self.cut.offset.at(places)[0]

    def approaches(self, normals: Array) -> Array:
        """(..., 3) approach directions where the surface has these normals."""
        if self.approach is not None:
            return np.broadcast_to(self.approach, normals.shape)
        return -self.cut.cells.surface.side_sign * normals

    def settled(self, source: Ints) -> Ints:
        """Nodes over the same places as some, where the arm has moved away from limits."""
        places = self.nodes.places.of(source)
        count = len(source)
        corners, radii = np.zeros((count, 4, 2, 3)), np.full((count, 2), np.inf)  # of no tile
        found, _ = self._tried(places, corners, radii, source, np.full(count, AT_REST))
        return np.where(found.node >= 0, found.node, source)

    def land(self, tiles: Tiles, source: Ints) -> Landed:
        """Follow lines from nodes `source` (k,) to the middles of tiles, and test these.

        Where a step fails the line is tried again with shorter ones.
        """
        count, bounds, middles = len(source), self.cut.bounds(tiles), tiles.middles
        corners = np.array(bounds.corners)
        corners[:, :, 1] = self.approaches(bounds.corners[:, :, 1])
        radii = bounds.radii.copy()
        if self.approach is not None:
            radii[:, 1] = 0.0
        done = Landed.nowhere(count, self.nodes.q.shape[1])
        gap = self.points(middles) - self.points(self.nodes.places.of(source))
        steps = np.ceil(np.linalg.norm(gap, axis=1) / STEP)
        parts = np.clip(steps, 1, MOST_STEPS).astype(np.int64)
        rows = np.arange(count)
        for attempt in range(TRIES):
            found, over = self._tried(
                middles.of(rows), corners[rows], radii[rows], source[rows], parts
            )
            done.put(rows, found)
            # A target that was not reached is mostly out of reach.
            again = (over > 1.0) & (parts < MOST_STEPS)
            again &= (over < UNKNOWN) | ((over == UNKNOWN) & (attempt == 0))
            if not again.any() or self.left <= 0:
                break
            rows, parts = rows[again], parts[again]
            longer = np.ceil(parts * np.clip(1.2 * np.sqrt(over[again]), 1.3, 4.0))
            parts = np.minimum(longer.astype(np.int64), MOST_STEPS)
        return done

    def _tried(
        self, end: Places, corners: Array, radii: Array, source: Ints, parts: Ints
    ) -> tuple[Landed, Array]:
        """One try of each line; and (k,) what it says of the steps, see `kernels.landing`."""
        nodes = self.nodes
        count, n = len(source), nodes.q.shape[1]
        lines = self.cut.lines(nodes.places.of(source), end, parts)
        self.lines += count
        points, normals = self.cut.offset.at(lines.places)
        path = np.empty((len(points), n))
        path[lines.first[:-1]] = nodes.q[source]
        gains, results = np.zeros((count, n, 3)), np.zeros((count, 2))
        land(
            self.arrays, self.work, self.memory,
            np.stack([points, self.approaches(normals)], axis=1), self._derivative_bounds(lines),
            lines.first,
            path, corners, radii, gains, results, self.left,
        )  # fmt: skip
        code = results[:, 0].astype(np.int64)
        node = np.full(count, -1)
        got = np.flatnonzero(code != UNREACHED)
        node[got] = self._kept(lines, path, source, got)
        return Landed(code, node, gains), results[:, 1]

    def _derivative_bounds(self, lines: Lines) -> Array:
        """(m, 2) of the piece that ends at each place, see `PlacePaths.derivative_bounds`."""
        total = len(lines.places.chart)
        bounds = np.zeros((total, 2))
        begin = np.delete(np.arange(total), lines.first[1:] - 1)
        path = self.cut.offset.paths(lines.places.of(begin), lines.places.of(begin + 1))
        single = path.share[:, 2] <= LONGER
        bounds[begin + 1] = np.where(single[:, None], path.derivative_bounds[:, 2], np.inf)
        if self.approach is not None:
            bounds[:, 1] = 0.0
        return bounds

    def _kept(self, lines: Lines, path: Array, source: Ints, got: Ints) -> Ints:
        """Keep the configurations along some lines as nodes; the last one's number of each."""
        lengths = np.diff(lines.first)[got] - 1
        line = np.repeat(np.arange(len(got)), lengths)
        begins = np.concatenate([[0], np.cumsum(lengths)])
        within = np.arange(begins[-1]) - begins[line]
        row = lines.first[got][line] + 1 + within
        came = np.where(within == 0, source[got][line], self._count + np.arange(len(row)) - 1)
        return self.add(Nodes(path[row], lines.places.of(row), came))[begins[1:] - 1]

    def holding(self, tiles: Tiles, landed: Landed) -> HeldTiles:
        """The tiles that hold."""
        good = landed.holds
        return HeldTiles(tiles.of(good), landed.node[good], landed.gains[good])
