"""Stations: the fewest placements of arms that together cover a surface.

A station is one arm with the surface at one placement, doing one continuous motion. What such a
motion covers is one component of that placement's search. So stations are a set cover of the cells
by components, solved to the proven optimum (see `feasibility.set_cover`). Among the fewest, the
stations with larger components are not preferred: how many is what costs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from coverable_errors import ArgumentError
from feasibility.division import set_cover

TIME_LIMIT = 60.0  # [s] for the optimum; tables of thousands of rows take far less


@dataclass(frozen=True, eq=False, slots=True)
class Station:
    """One arm at one placement, doing one continuous motion."""

    row: int
    """Row of the table, or of the study."""
    component: int
    """Which of that row's components; 0 for a table of covers."""
    covers: NDArray[np.bool_]
    """(N,) cells that its motion can cover."""
    cells: NDArray[np.int64]
    """(k,) cells given to it: each needed cell to one station, to the one that covers most."""


@dataclass(frozen=True, eq=False, slots=True)
class Stations:
    """The fewest stations found."""

    stations: tuple[Station, ...]
    """The one given most cells first."""
    left_out: NDArray[np.int64]
    """(k,) needed cells that no component covers."""
    bound: int
    """No fewer stations cover what these cover."""

    def __len__(self) -> int:
        """Number of stations."""
        return len(self.stations)

    @property
    def optimal(self) -> bool:
        """Is it proved that no fewer will do, given the components found?"""
        return len(self.stations) <= self.bound

    @property
    def whole(self) -> bool:
        """Is every needed cell given to a station?"""
        return len(self.left_out) == 0


def fewest_stations(
    covers: ArrayLike, needed: ArrayLike | None = None, time_limit: float = TIME_LIMIT
) -> Stations:
    """The fewest rows of a table that together cover what all of them cover.

    Args:
        covers: (K, N) True where row k, one continuous motion of one arm at one placement, covers
            cell c.
        needed: (N,) cells to cover; default all.
        time_limit: s, for the proof of the optimum.

    Raises:
        ArgumentError: the tables do not fit together.

    Example:
        >>> table = [[1, 1, 0, 0], [0, 0, 1, 0], [0, 1, 1, 1]]
        >>> found = fewest_stations(table)
        >>> [(s.row, s.cells.tolist()) for s in found.stations], found.optimal
        ([(2, [1, 2, 3]), (0, [0])], True)
    """
    table = np.asarray(covers, dtype=bool)
    if table.ndim != 2:
        raise ArgumentError(f"covers must have shape (K, N), got {table.shape}")
    owners = [(row, 0) for row in range(len(table))]
    return _chosen(table, owners, needed, time_limit)


def stations_of(
    results: Sequence[Mapping[str, Any]],
    needed: ArrayLike | None = None,
    time_limit: float = TIME_LIMIT,
) -> Stations:
    """The fewest stations among the outcomes of a study, or the trials of a search for placements.

    Args:
        results: one for each arm and placement, with `cells`, how many there are, and
            `components`, the cells of each as hexadecimal bits: what `study_outcome.outcome_of` and
            `placement_study.trial_table` give. Those without components count as covering nothing.
        needed: (N,) cells to cover; default all.
        time_limit: s, for the proof of the optimum.

    Raises:
        ArgumentError: the outcomes are of surfaces with different numbers of cells, or damaged.
    """
    from feasibility.studies import cells_of

    rows, owners, counts = [], [], set()
    for row, result in enumerate(results):
        components = result.get("components") or []
        if components:
            counts.add(int(result["cells"]))
        for component, bits in enumerate(components):
            rows.append(cells_of(bits, int(result["cells"])))
            owners.append((row, component))
    if len(counts) > 1:
        listed = ", ".join(str(count) for count in sorted(counts))
        raise ArgumentError(f"the outcomes are of different surfaces: they have {listed} cells")
    n = counts.pop() if counts else (0 if needed is None else len(np.asarray(needed)))
    return _chosen(np.array(rows, dtype=bool).reshape(len(rows), n), owners, needed, time_limit)


def _chosen(
    table: NDArray[np.bool_],
    owners: Sequence[tuple[int, int]],
    needed: ArrayLike | None,
    time_limit: float,
) -> Stations:
    """Choose rows of a table, and share its cells out among them."""
    n = table.shape[1]
    wanted = np.ones(n, dtype=bool) if needed is None else np.asarray(needed, dtype=bool)
    if wanted.shape != (n,):
        raise ArgumentError(
            f"needed must have shape ({n},) as covers has cells, got {wanted.shape}"
        )
    can = wanted & table.any(axis=0)
    found = set_cover(table[:, can], time_limit)
    rows = sorted(found.rows, key=lambda row: (-int((table[row] & can).sum()), row))
    # Each cell to the first of them that covers it.
    owner = np.where(can, np.argmax(table[rows], axis=0) if rows else 0, -1)
    stations = [
        Station(*owners[row], covers=table[row].copy(), cells=np.flatnonzero(owner == k))
        for k, row in enumerate(rows)
    ]
    stations.sort(key=lambda station: (-len(station.cells), station.row, station.component))
    for station in stations:
        station.covers.flags.writeable = station.cells.flags.writeable = False
    return Stations(tuple(stations), np.flatnonzero(wanted & ~can), found.bound)
