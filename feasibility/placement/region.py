"""Where a surface may stand: one pose of its frame, and regions of poses."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from coverable.arrays import Array
from coverable.errors import CoverableError
from feasibility.studies.combinations import spread
from surfaces.cells import Cells
from surfaces.patches.grid_cells import GridCells
from surfaces.surface import Surface, rotation_from_rpy

Triple = tuple[float, float, float]

AXES = ("x", "y", "z", "roll_deg", "pitch_deg", "yaw_deg")
FURTHEST = 1e3  # [m] and [deg]: nothing sensible lies beyond
DIGITS = 6  # of the numbers of a pose that is tried
UPRIGHT = 1e-9  # [1], cosine of the pitch below which roll and yaw turn about one axis


class PlacementError(CoverableError):
    """A region, or a question about it, that makes no sense: what was wrong, and what would do."""


class Pose(NamedTuple):
    """Pose of a surface's frame in the root frame, in the numbers of a case file."""

    position: Triple
    """m."""
    rpy_deg: Triple
    """Fixed-axis roll, pitch, yaw in degrees."""

    @property
    def rotation(self) -> Array:
        """(3, 3) axes of the frame, as columns, in the root frame."""
        return rotation_from_rpy(*np.radians(self.rpy_deg))

    @property
    def values(self) -> Array:
        """(6,) in the order of `AXES`."""
        return np.array([*self.position, *self.rpy_deg])

    @staticmethod
    def of_values(values: Sequence[float] | Array) -> "Pose":
        """The pose with six numbers in the order of `AXES`."""
        x, y, z, roll, pitch, yaw = (float(value) for value in values)
        return Pose((x, y, z), (roll, pitch, yaw))

    @staticmethod
    def of_surface(surface: Surface) -> "Pose":
        """Where a surface stands. Standing upright (pitch +-90 degrees) it is given roll 0."""
        r = surface.rotation
        flat = math.hypot(r[0, 0], r[1, 0])
        pitch = math.atan2(-r[2, 0], flat)
        if flat > UPRIGHT:
            roll, yaw = math.atan2(r[2, 1], r[2, 2]), math.atan2(r[1, 0], r[0, 0])
        else:
            roll, yaw = 0.0, math.atan2(-r[0, 1], r[1, 1])
        return Pose.of_values([*surface.position, *np.degrees([roll, pitch, yaw])])


@dataclass(frozen=True, slots=True)
class Region:
    """All poses between two ends, one range for each of `AXES`; what does not vary has equal ends.

    Example:
        >>> from coverable import plane
        >>> plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3))
        >>> region = Region.around(Pose.of_surface(plate), {"x": (-0.3, 0.3), "yaw_deg": (0, 90)})
        >>> region.varies
        ('x', 'yaw_deg')

    Raises:
        PlacementError: with everything that is wrong with the ranges.
    """

    ranges: tuple[tuple[float, float], ...]
    """Six pairs (lowest, highest), m and degrees."""

    def __post_init__(self) -> None:
        """Refuse ranges that hold nothing."""
        faults = []
        if len(self.ranges) != len(AXES):
            raise PlacementError(f"a region has {len(AXES)} ranges, got {len(self.ranges)}")
        for name, (low, high) in zip(AXES, self.ranges, strict=True):
            degrees, shown, fault = name.endswith("_deg"), f"{low:g} .. {high:g}", ""
            unit = "degrees" if degrees else "metres"
            if not (math.isfinite(low) and math.isfinite(high)):
                fault = f"is no range; expected two finite numbers ({unit})"
            elif low > high:
                fault = f"is empty; the lowest comes first: {high:g} .. {low:g}"
            elif max(abs(low), abs(high)) > FURTHEST:
                fault = f"is too far; at most {FURTHEST:g} ({unit})"
            elif degrees and high - low > 360.0:
                fault = "is more than a full turn; at most 360 degrees wide"
            faults += [f"{name}: {shown} {fault}"] if fault else []
        if not faults and not self.varies:
            faults.append(f"nothing varies; give a range of {', '.join(AXES)} whose ends differ")
        if faults:
            raise PlacementError(faults, "region")

    @staticmethod
    def around(pose: Pose, ranges: Mapping[str, Any]) -> "Region":
        """The region with ranges (lowest, highest) of some of `AXES`; all else stays as at `pose`.

        They are absolute: m and degrees in the root frame.

        Raises:
            PlacementError: with everything that is wrong.
        """
        held = dict(zip(AXES, ((v, v) for v in pose.values.tolist()), strict=True))
        faults = []
        for name, given in ranges.items():
            if name not in held:
                faults.append(f"{name}: is not known here; known are {', '.join(AXES)}")
                continue
            try:
                low, high = (float(value) for value in given)
            except (TypeError, ValueError):
                faults.append(f"{name}: expected two numbers, got {given!r}")
                continue
            held[name] = (low, high)
        if faults:
            raise PlacementError(faults, "region")
        return Region(tuple(held[name] for name in AXES))

    @property
    def low(self) -> Array:
        """(6,) m and degrees."""
        return np.array([low for low, _ in self.ranges])

    @property
    def high(self) -> Array:
        """(6,) m and degrees."""
        return np.array([high for _, high in self.ranges])

    @property
    def varies(self) -> tuple[str, ...]:
        """The axes whose ends differ."""
        return tuple(
            name for name, (low, high) in zip(AXES, self.ranges, strict=True) if low < high
        )

    def holds(self, pose: Pose, slack: float = 1e-9) -> bool:
        """Does the pose lie in the region?"""
        values = pose.values
        return bool(((values >= self.low - slack) & (values <= self.high + slack)).all())

    def samples(self, count: int, seed: int) -> Array:
        """(count, 6) poses, the middle first, then spread evenly by a Sobol sequence."""
        free = self.high > self.low
        values = np.tile(0.5 * (self.low + self.high), (count, 1))
        rng = np.random.default_rng(seed)
        others = spread(self.low[free], self.high[free], max(count - 1, 0), rng)
        values[1:, free] = others
        return self.rounded(values)

    def rounded(self, values: Array) -> Array:
        """Poses that people can write down, inside the region still."""
        return np.clip(np.round(values, DIGITS), self.low, self.high)


def moved_cells(cells: Cells, pose: Pose) -> Cells:
    """The same cells with the surface's frame at another pose."""
    old = cells.surface
    rotation, position = pose.rotation, np.array(pose.position)
    surface = replace(old, rotation=rotation, position=position)
    if isinstance(cells, GridCells):
        # Cut anew: to the last bit what a case with this pose builds.
        return GridCells.cut(surface, *cells.shape)  # pyrefly: ignore[bad-argument-type]
    turn = rotation @ old.rotation.T
    made = replace(
        cells,
        surface=surface,
        centres=(cells.centres - old.position) @ turn.T + position,
        normals=cells.normals @ turn.T,
    )
    if "figures" in vars(cells):  # of a mesh: known in its own frame
        vars(made)["figures"] = vars(cells)["figures"]
    return made
