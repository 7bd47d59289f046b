"""Placements that need no search: targets beyond the arm's reach, one pose or a region.

The tool point is never further from the first joint than the reach bound R (see `robots.reach`).
So a pose is ruled out where a target lies further off than R and the tolerance. For a box of
poses, let c be a target in the surface's frame, B the box of positions, and Q the rotation in the
middle of the ranges of roll, pitch and yaw, whose half widths add up to at most t (angles of
rotations that follow each other add up at most). Then for every pose in the box

    |R c + p - o|  >=  dist(o - Q c, B) - 2 |c| sin(min(t, pi) / 2).

Boxes for which this leaves a target in reach are halved, until none is left or too many are.
"""

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.placement.region import Pose, Region
from feasibility.task import Task
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.surface import rotation_from_rpy

MOST_BOXES = 4096  # boxes of poses tested before the region counts as open
MOST_TARGETS = 200  # targets that each box is tested for; a bound on some is one on all


@dataclass(frozen=True, eq=False, slots=True)
class Reach:
    """The targets of a task in the surface's own frame, and how far the arm reaches."""

    targets: Array
    """(N, 3) m, in the surface's frame."""
    areas: Array
    """(N,) m^2 of the cells."""
    origin: Array
    """(3,) m, the first joint in the root frame."""
    reach: float
    """m."""
    tolerance: float
    """m."""

    @staticmethod
    def of(robot: Robot, cells: Cells, task: Task) -> "Reach":
        """The targets of a task on these cells, in the surface's frame."""
        surface = cells.surface
        return Reach(
            targets=(task.targets(cells).points - surface.position) @ surface.rotation,
            areas=np.array(cells.areas),
            origin=robot.base_point,
            reach=robot.reach,
            tolerance=task.effective_tolerance,
        )

    def distances(self, values: Array) -> Array:
        """(k, N) m, of the targets from the first joint, with the surface at poses (k, 6)."""
        turns = np.array([Pose.of_values(row).rotation for row in values]).reshape(-1, 3, 3)
        offset = values[:, None, :3] - self.origin
        return np.asarray(np.linalg.norm(np.einsum("kij,nj->kni", turns, self.targets) + offset,
                                         axis=2))  # fmt: skip

    def within(self, values: Array) -> Mask:
        """(k, N) False where a target is proved out of reach."""
        return self.distances(values) <= self.reach + self.tolerance

    def share(self, values: Array) -> Array:
        """(k,) share of the area within reach, at most: nothing beyond can be covered."""
        share = self.within(values) @ self.areas / self.areas.sum()
        return np.minimum(share, 1.0)  # sums in another order may round to a little more

    def beyond(self, region: Region) -> tuple[float, int] | None:
        """Whether every placement in a region has a target out of reach; None where not shown.

        That is the distance (m) of some target from the first joint in every placement, at least,
        and the number of boxes of poses that this was shown for.
        """
        some = np.unique(np.linspace(0, len(self.targets) - 1, MOST_TARGETS).astype(np.int64))
        furthest = float(np.linalg.norm(self.targets, axis=1).max())
        boxes = [(region.low, region.high)]
        nearest, tested = np.inf, 0
        while boxes:
            low, high = boxes.pop()
            tested += 1
            least = self._least(low, high, self.targets[some])
            if least > self.reach + self.tolerance:
                nearest = min(nearest, least)
                continue
            middle = 0.5 * (low + high)
            # A pose in reach ends it at once, and so do boxes too many or too small.
            if tested + len(boxes) >= MOST_BOXES or self.within(middle[None]).all():
                return None
            # How far each width moves the furthest target, m.
            axis = int(np.argmax((high - low) * [1.0, 1.0, 1.0, *[np.radians(furthest)] * 3]))
            for start, end in ((low[axis], middle[axis]), (middle[axis], high[axis])):
                one, other = low.copy(), high.copy()
                one[axis], other[axis] = start, end
                boxes.append((one, other))
        return nearest, tested

    def _least(self, low: Array, high: Array, targets: Array) -> float:
        """m: in every pose of the box some target is at least so far from the first joint."""
        turn = rotation_from_rpy(*np.radians(0.5 * (low[3:] + high[3:])))
        half = float(np.radians(0.5 * (high[3:] - low[3:])).sum())
        wanted = self.origin - targets @ turn.T
        apart = np.linalg.norm(wanted - np.clip(wanted, low[:3], high[:3]), axis=1)
        sway = 2.0 * np.linalg.norm(targets, axis=1) * np.sin(0.5 * min(half, np.pi))
        return float((apart - sway).max())
