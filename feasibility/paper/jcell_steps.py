"""How far one J-cell step goes: its size, the tolerance that fits it, and the margin between them.

Between two J-cells the arm moves on a straight line in joint space, s_j the step of joint j and r_j
the longest lever arm the tool point can have about it. Along that line

    |p''| <= D  = sum_j r_j s_j (s_j + 2 sum_{i<j} s_i)    (revolute i; a prismatic joint j adds
                                                            2 s_j sum_{i<j} s_i instead)
    |a''| <= Da = sum_j s_j (s_j + 2 sum_{i<j} s_i)        (revolute i and j)
    |p'|  <= L  = sum_j r_j s_j                            (s_j for a prismatic joint)

With k and b the surface's bounds on the first and second derivative of its normals, the height of
the tool point and the chord |a - approach direction| leave the values at the two ends by at most

    sag = (D + k L^2) / 8    and    turn = (Da + b L^2 + k D) / 8

so J-cells that keep this margin hold the constraints between them, too. It is small: of the second
order in the step, where the tolerance is of the first.

That is for closed forms, whose k and b are proved. On any other surface b is not known, and a
normal that turns by at most k L leaves the straight line between its ends by half of that at most:
turn = Da / 8 + k L / 2. (Where the approach is one direction, turn = Da / 8.) On a mesh with edges
of length e the height has a kink over each: its slope changes by k (L + e) at most along a step,
and never by more than 2, so sag = D / 8 + L / 4 times that. There k is what the triangles of each
cell have, which is not proved; the replay of the tree checks what comes of it between J-cells.
Besides, these surfaces are searched on triangles (`surfaces.triangle_kernel`), and how far these
may be off is taken off too.

Where the roll is limited, a step changes it by (W + k_t L) / cos(cone / 2) at most, with W, the sum
of s_j, for the tool, and k_t for how fast the frame on the surface turns (`FrameCurves`). So half
of that is taken off both ends of its range.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.cone import chord_of
from feasibility.search_settings import Search
from feasibility.targets.curves import target_curves
from feasibility.task import Task
from robots.robot import Robot
from surfaces.cell_triangles import Triangulation, triangulation
from surfaces.cells import Cells
from surfaces.patches.grid_cells import GridCells
from surfaces.patches.normal_bounds import bounds_of
from surfaces.patches.patch import ClosedFormPatch
from surfaces.piecewise.piece_cells import PieceCells

TOLERANCE_STEPS = 0.5
"""Default tolerance, in steps times reach: half of what the tool can move in one step."""
CROSSED = 0.5
"""[1] of the tolerance or the cone: creases that take more of it are not crossed."""


@dataclass(frozen=True, eq=False, slots=True)
class Steps:
    """Moves between neighbouring J-cells over N cells."""

    size: Array
    """(n,) delta q, rad; for a prismatic joint the length (m) that angle sweeps at the reach."""
    moves: Literal["single", "all"]
    tolerance: float
    """m, the task's; where it has none, step times reach times `TOLERANCE_STEPS`. The offset
    surface is never met exactly on a grid of joint values (paper, eq. 5)."""
    sag: Array
    """(N,) m, margin for the tool point between J-cells; inf where it cannot be bounded."""
    turn: Array
    """(N,) margin for |a - approach direction| between J-cells."""
    cone_cosine: Array
    """(N,) least cosine of the angle between axis and approach direction at a J-cell: -2 where any
    angle will do, 2 where the cone is too narrow for a step."""
    roll: Array
    """(2,) rad, middle and half width of the range of the roll at a J-cell, with a margin between
    J-cells taken off; half is inf where the roll is free."""
    triangles: Triangulation | None
    """What is searched in place of the surface; None for closed forms."""
    barred: frozenset[tuple[int, int]]
    """Pairs of cells, the lower first, on both sides of a crease that no motion is certified to
    cross: the place that the tool is over would jump, by more than the tolerance."""

    @property
    def allowed(self) -> str:
        """What a step may be too coarse for, in words."""
        roll = np.isfinite(self.roll[1])
        return "the tolerance, the cone or the roll" if roll else "the tolerance or the cone"

    @property
    def usable(self) -> Mask:
        """(N,) cells over which some J-cell may be feasible: the step is not too coarse there."""
        fine = (self.sag < self.tolerance) & (self.cone_cosine < 1.0)
        return np.asarray(fine & bool(self.roll[1] > 0.0))

    @staticmethod
    def of(robot: Robot, cells: Cells, task: Task, search: Search) -> Steps:
        """The steps of a search.

        Raises:
            SurfaceError: nothing is known of the surface between its places.
        """
        step = math.radians(search.step_deg)
        reach = _extent(robot)
        size = np.where(robot.prismatic, step * reach, step)
        tolerance = TOLERANCE_STEPS * step * reach if task.tolerance is None else task.tolerance
        bounds = _step_bounds(robot, size, search.moves == "all")
        height = cells.surface.side_sign * task.standoff
        triangles = None
        if isinstance(cells, GridCells) and isinstance(cells.surface, ClosedFormPatch):
            both = _margins_of_patch(cells.surface, bounds, height, tolerance)
            sags, turns = (np.full(len(cells), margin) for margin in both)
        else:
            by_u = task.roll is not None and task.roll_reference is None
            triangles = triangulation(cells, height, tolerance, tangents=by_u)
            sags, turns = _margins_of_triangles(triangles, bounds)
        jump, kink, barred = _creases(cells, task, tolerance)
        sags, turns = sags + jump, turns + kink
        if task.fixed_approach(cells) is not None:
            turns = np.full(len(cells), bounds.axis / 8.0)
        chord = chord_of(task.cone) - turns
        cosine = np.where(chord > 0.0, 1.0 - 0.5 * np.minimum(chord, 4.0) ** 2, 2.0)
        if task.cone_deg >= 180.0:
            cosine = np.full(len(cells), -2.0)
        off = 0.0 if triangles is None else 2.0 * (triangles.turn + triangles.swerve)
        roll = _roll(cells, task, bounds, off)
        return Steps(size, search.moves, tolerance, sags, turns, cosine, roll, triangles, barred)


class _StepBounds(NamedTuple):
    """Bounds along a step: D (m), Da, L (m) and W of the module's docstring."""

    point: float
    axis: float
    length: float
    rotation: float


def _extent(robot: Robot) -> float:
    """The reach (m); where an endless rail makes that infinite, the sum of the link lengths."""
    if math.isfinite(robot.reach):
        return robot.reach
    return float(np.linalg.norm(robot.chain.translations[1:], axis=1).sum())


def _step_bounds(robot: Robot, size: Array, together: bool) -> _StepBounds:
    """The bounds along a step of sizes (n,); inf on a rail without end."""
    prismatic = robot.prismatic
    stroke = np.where(prismatic, np.maximum(np.abs(robot.lower), np.abs(robot.upper)), 0.0)
    links = np.linalg.norm(robot.chain.translations[1:], axis=1)
    # The lever about joint j: all links after it, and all strokes after it.
    lever = np.cumsum((links + np.append(stroke[1:], 0.0))[::-1])[::-1]
    angle = np.where(prismatic, 0.0, size)
    before = np.cumsum(angle) - angle if together else np.zeros(robot.n)
    reach = np.where(prismatic, 1.0, lever)
    point = size * np.where(prismatic, 2.0 * before, lever * (size + 2.0 * before))
    axis = angle * (angle + 2.0 * before)
    parts = (point, axis, reach * size, angle)
    return _StepBounds(*(float(part.sum() if together else part.max()) for part in parts))


def _margins_of_patch(
    surface: ClosedFormPatch, step: _StepBounds, height: float, tolerance: float
) -> tuple[float, float]:
    """Sag (m) and turn between J-cells over a closed form."""
    d, da, length, _ = step
    bounds = bounds_of(surface, height, tolerance)
    if not math.isfinite(d + bounds.curvature + bounds.second_derivative):
        return math.inf, math.inf  # the offset surface folds, or a rail has no end
    return (
        (d + bounds.curvature * length**2) / 8.0,
        (da + bounds.second_derivative * length**2 + bounds.curvature * d) / 8.0,
    )


def _margins_of_triangles(triangles: Triangulation, step: _StepBounds) -> tuple[Array, Array]:
    """(N,) sag (m) and turn between J-cells over triangles, and what these may be off."""
    d, da, length, _ = step
    k, edge = triangles.curvature, triangles.edge
    if not math.isfinite(d):
        return np.full(len(k), math.inf), np.full(len(k), math.inf)
    curved = k * length**2 / 8.0
    if edge > 0.0:
        curved = np.minimum(k * (length + edge), 2.0) * length / 4.0
    sags = d / 8.0 + curved + triangles.off
    return sags, da / 8.0 + k * length / 2.0 + triangles.turn


def _roll(cells: Cells, task: Task, step: _StepBounds, off: float) -> Array:
    """(2,) rad, see `Steps.roll`; `off` is how far the roll may be by normals and frames."""
    if task.roll is None:
        return np.array([0.0, np.inf])
    frames = target_curves(cells, task).frames
    curvature = np.zeros(0) if frames is None else frames.curvature
    by_metre = float(curvature[np.isfinite(curvature)].max(initial=0.0))
    rate = (step.rotation + by_metre * step.length) / math.cos(0.5 * task.cone)
    return np.array([task.roll.middle, task.roll.half - 0.5 * rate - off])


def _creases(
    cells: Cells, task: Task, tolerance: float
) -> tuple[float, float, frozenset[tuple[int, int]]]:
    """How far targets (m) and normals jump over seams, and the pairs over those where they cannot.

    There it is more than half of the tolerance, or of the cone.
    """
    if not isinstance(cells, PieceCells):
        return 0.0, 0.0, frozenset()
    sharp, least = set[tuple[int, int]](), 0.0
    for seam in cells.surface.seams:
        chord = 2.0 * math.sin(0.5 * seam.crease)
        if chord * task.standoff > CROSSED * tolerance or chord > CROSSED * task.cone_chord:
            sharp.add(seam.pieces)
        else:
            least = max(least, chord)
    owner = np.sort(cells.piece[cells.pairs], axis=1)
    barred = (
        (i, j)
        for (i, j), pieces in zip(cells.pairs.tolist(), owner.tolist(), strict=True)
        if tuple(pieces) in sharp
    )
    return least * task.standoff, least, frozenset(barred)
