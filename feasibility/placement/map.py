"""A map of placements: covered share and margin over two or three axes of a region."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Protected
from feasibility.placement.region import AXES, PlacementError, Pose, Region
from feasibility.placement.trials import Evaluator, search_all
from feasibility.search_settings import Progress

SIDE = 15  # places along each of the first two axes
PANELS = 3  # places along the third


@dataclass(frozen=True, eq=False, slots=True)
class PlacementMap(Protected):
    """A raster of placements; what is not among its axes is held at one pose."""

    axes: tuple[str, ...]
    """Two or three of `AXES`."""
    held: Pose
    ticks: tuple[Array, ...]
    """Places along each axis, m or degrees."""
    share: Array
    """(a, b) or (a, b, c) largest share of the area that one motion was found to cover; NaN where
    it could not be tried."""
    margin: Array
    """Likewise the margin in m, see `Trial.margin`; 0 where none is feasible."""


def axes_of(region: Region) -> tuple[str, ...]:
    """The axes that a map is most often wanted over: two shifts and a rotation, where they vary."""
    shifts = [name for name in region.varies if not name.endswith("_deg")]
    turns = [name for name in reversed(region.varies) if name.endswith("_deg")]
    chosen = shifts[:2] + turns[:1] + shifts[2:] + turns[1:]
    return tuple(chosen[:3] if len(shifts) >= 2 else chosen[:2])


def placement_map(
    evaluator: Evaluator,
    region: Region,
    held: Pose,
    axes: Sequence[str] | None = None,
    shape: Sequence[int] | None = None,
    progress: Progress | None = None,
) -> PlacementMap:
    """A wide look at every placement of a raster.

    Args:
        evaluator, progress: as for `place`.
        region: its ranges are the map's.
        held: values of the axes that are not mapped, such as those of the best placement.
        axes: two or three of those that vary; default `axes_of`. One is mapped as a strip.
        shape: places along each.

    Raises:
        PlacementError: there are no such axes, or the shape does not fit them.
    """
    names = axes_of(region) if axes is None else tuple(axes)
    faults = [f"{name}: does not vary in the region" for name in names if name not in region.varies]
    if not 1 <= len(names) <= 3 or len(set(names)) < len(names):
        faults.append(f"axes: expected one to three different ones of {', '.join(region.varies)}")
    counts = [SIDE, SIDE, PANELS][: len(names)] if shape is None else list(shape)
    if len(counts) != len(names) or min(counts, default=0) < 1:
        faults.append(f"shape: expected {len(names)} whole numbers >= 1, got {counts}")
    if faults:
        raise PlacementError(faults, "map")
    if len(names) == 1:
        other = next(name for name in AXES if name not in names)
        names, counts = (*names, other), [*counts, 1]
    where = [AXES.index(name) for name in names]
    ticks = tuple(
        np.linspace(region.low[k], region.high[k], count)
        if count > 1
        else np.array([0.5 * (region.low[k] + region.high[k])])
        for k, count in zip(where, counts, strict=True)
    )
    values = np.tile(held.values, (int(np.prod(counts)), 1))
    grid = np.meshgrid(*ticks, indexing="ij")
    for k, places in zip(where, grid, strict=True):
        values[:, k] = places.ravel()
    poses = [Pose.of_values(row) for row in values]
    trials = search_all(evaluator, poses, progress, "searching the map")
    found = [(np.nan,) * 2 if one.failed else (one.share, one.margin) for one in trials]
    share, margin = np.array(found).T
    return PlacementMap(names, held, ticks, share.reshape(counts), margin.reshape(counts))
