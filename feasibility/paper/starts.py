"""Start configurations over one cell: projection from random ones, one per distinct branch.

The paper starts at "a feasible J-cell" and says that the choice may affect the result, so that one
can run the method with every candidate. A candidate here has its tool point at the target of the
start cell and its tool axis along the approach direction; what freedom is left (roll, redundancy)
is used to stay near the middle of the joint limits. An arm that cannot align its tool (a planar
one, say) gets starts with the axis inside the cone.

Two candidates are the same branch when a self-motion joins them: a motion that keeps the tool point
and the alignment, inside the limits. It is followed straight from one towards the other, so
branches joined only by a detour count as two; that costs time, never an answer.
"""

from collections.abc import Iterator

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.clock import Clock
from feasibility.search_settings import Search
from feasibility.task import Targets, Task
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.patches.grid_cells import GridCells

ACCURACY = 1e-9  # [m], [1]: of a start's tool point and axis
CLOSE = 1e-3  # [rad], [m]: configurations nearer than this are taken as one
STALLED = 1e-7  # [rad], [m]: a Newton step this short, away from the manifold, leads nowhere
LONGEST_STEP = 0.5  # [rad], [m]: of one joint, per Newton step
STRIDE = 0.2  # [rad], [m]: of one joint, per step of a self-motion
STRIDES = 60  # at most, in one self-motion
DRY_SEEDS = 40  # random configurations in a row that bring nothing new, before the search ends
FEW_SEEDS = 10  # random configurations to try over each cell once the middle one had no start
MOST_STARTS = 32  # windings of joints with several turns make branches without end


class StartProjection:
    """The configurations that hold the tool at one target: projection onto it, motion along it."""

    def __init__(
        self,
        robot: Robot,
        point: Array,
        approach: Array,
        cone: float,
        reference: Array | None = None,
    ) -> None:
        """Configurations of `robot` with the tool at `point` (3,) m, its axis at `approach` (3,).

        The `cone` is the angle (rad) by which the axis may deviate where it cannot be aligned;
        `reference` (3,) is where the TCP's reference axis has to point beside it, if anywhere.
        """
        self._kinematics = Kinematics(robot)
        self._reference, self._own_reference = reference, robot.reference_axis
        self._point, self._approach = point, approach
        self._cone_cosine = float(np.cos(0.98 * cone))  # starts keep off the cone's boundary
        self._lower, self._upper = robot.lower, robot.upper
        reach = robot.reach
        self._length = 0.3 * reach if 0.0 < reach < np.inf else 1.0  # m per rad of misalignment

    def _rows(self, q: Array, align: bool) -> tuple[Array, Array]:
        """Residuals (m,) and their Jacobian (m, n): tool point, then alignment or violated cone."""
        point, axis = self._kinematics.tool(q)
        point_rows, axis_rows = self._kinematics.jacobians(q)
        error = self._point - point
        if align:
            off, rows = [self._approach - axis], [axis_rows]
            if self._reference is not None:
                across = self._kinematics.rotation(q) @ self._own_reference
                turns = self._kinematics.twists(q[None])[0, 3:]
                off.append(self._reference - across)
                rows.append(np.cross(turns, across, axis=0))
            return (
                np.concatenate([error, *(self._length * part for part in off)]),
                np.vstack([point_rows, *(self._length * part for part in rows)]),
            )
        short = self._cone_cosine - self._approach @ axis
        if short <= 0.0:
            return error, point_rows
        return (
            np.append(error, self._length * short),
            np.vstack([point_rows, self._length * self._approach @ axis_rows]),
        )

    def project(self, q: Array, align: bool, steps: int = 60) -> Array | None:
        """Damped Newton steps from q (n,) onto the manifold, joints stopping at their limits.

        Returns:
            A configuration (n,) on the manifold; None where Newton fails.
        """
        q = np.clip(q, self._lower, self._upper)
        damping = 1e-2
        residual, jacobian = self._rows(q, align)
        for _ in range(steps):
            size = np.abs(residual).max()
            if size < ACCURACY:
                return q
            free = self._free(q, jacobian.T @ residual)
            j = jacobian[:, free]
            gram = j @ j.T
            scale = damping * np.trace(gram) / len(gram) + 1e-15
            move = j.T @ np.linalg.solve(gram + scale * np.eye(len(gram)), residual)
            if np.abs(move).max(initial=0.0) < STALLED:
                return None
            trial = q.copy()
            trial[free] += move * min(1.0, LONGEST_STEP / max(np.abs(move).max(initial=0.0), 1e-12))
            trial = np.clip(trial, self._lower, self._upper)
            next_residual, next_jacobian = self._rows(trial, align)
            if np.linalg.norm(next_residual) < np.linalg.norm(residual) or len(
                next_residual
            ) != len(residual):
                q, residual, jacobian = trial, next_residual, next_jacobian
                damping = max(damping * 0.1, 1e-12)
            else:
                damping *= 10.0
                if damping > 1e4:
                    return None
        return q if np.abs(residual).max() < ACCURACY else None

    def _free(self, q: Array, pull: Array) -> Mask:
        """(n,) joints that are not held at a limit by a pull (n,) beyond it."""
        return ~(((q <= self._lower) & (pull < 0)) | ((q >= self._upper) & (pull > 0)))

    def toward(self, q: Array, goal: Array, align: bool) -> Array:
        """Follow the manifold from q (n,) towards `goal` (n,), until it comes no nearer."""
        for _ in range(STRIDES):
            _, jacobian = self._rows(q, align)
            pull = goal - q
            free = self._free(q, pull)
            # The part of the pull that leaves the residuals alone: directions whose singular
            # value is nil belong to the manifold's tangent.
            _, values, basis = np.linalg.svd(jacobian[:, free], full_matrices=True)
            rank = int((values > 1e-8 * max(values[0], 1e-300)).sum()) if len(values) else 0
            along = np.zeros(len(q))
            along[free] = basis[rank:].T @ (basis[rank:] @ pull[free])
            size = np.abs(along).max(initial=0.0)
            if size < 1e-2 * CLOSE:
                break
            projected = self.project(q + along * min(1.0, STRIDE / size), align, steps=8)
            if projected is None or not (np.linalg.norm(goal - projected) < np.linalg.norm(pull)):
                break
            q = projected
        return q


def starts(
    robot: Robot,
    point: Array,
    approach: Array,
    cone: float,
    seed: int = 0,
    patience: int = DRY_SEEDS,
    reference: Array | None = None,
) -> Iterator[Array]:
    """Configurations (n,) over one target, one per distinct branch, as they are found.

    Args:
        robot: the arm.
        point: (3,) target of the tool point, m.
        approach: (3,) unit approach direction.
        cone: angle (rad) the tool axis may deviate from it.
        seed: of the random configurations.
        patience: random configurations to try before the first is found.
        reference: (3,) where the TCP's reference axis points in all of them; None for anywhere.
    """
    projection = StartProjection(robot, point, approach, cone, reference)
    window = _window(robot)
    middle = window.mean(axis=0)  # of the limits; zero for endless joints
    for align in (True, False) if reference is None else (True,):
        rng = np.random.default_rng(seed)
        found: list[Array] = []
        left = patience
        while left > 0 and len(found) < MOST_STARTS:
            left -= 1
            q = projection.project(rng.uniform(window[0], window[1]), align)
            if q is None:
                continue
            q = projection.toward(q, middle, align)
            # Joined: the self-motion from q straight towards the other arrives there.
            moved = (np.abs(projection.toward(q, other, align) - other) for other in found)
            if not any(off.max(initial=0.0) < CLOSE for off in moved):
                found.append(q)
                left = DRY_SEEDS
                yield q
        if found:
            return


def candidates(
    robot: Robot, cells: Cells, task: Task, search: Search, usable: Mask, clock: Clock | None = None
) -> Iterator[Array]:
    """Start configurations (n,) over the start cell, as many as the search asks for.

    The start cell of a grid is the one in the middle of the list (cell 45 of 90), from where this
    search touches more cells of the paper's cases than from the first; elsewhere the one nearest to
    the middle of the surface. Where it has no start, the next to it that has some.

    Args:
        robot, cells, task, search: see `check`.
        usable: (N,) cells that may be the start cell.
        clock: when to give up.
    """
    targets = task.targets(cells)
    away = np.abs(np.arange(len(cells)) - len(cells) // 2).astype(float)
    if not isinstance(cells, GridCells) and len(cells):
        away = np.linalg.norm(cells.centres - cells.centres[cells.middle], axis=1)
    order = np.argsort(away, kind="stable")
    within = usable & (robot.distance_from_base(targets.points) <= robot.reach)
    for number, cell in enumerate(order):
        if not within[cell]:
            continue
        found, patience = 0, FEW_SEEDS if number else DRY_SEEDS
        aim = targets.points[cell], targets.approaches[cell], task.cone, search.seed, patience
        for reference in _references(task, targets, int(cell)):
            if found:
                break
            for q in starts(robot, *aim, reference):
                yield q
                found += 1
                if found == search.starts:
                    break
        if found or (clock is not None and clock.out_of_time):
            return


def _references(task: Task, targets: Targets, cell: int) -> tuple[Array | None, ...]:
    """Where the TCP's reference axis may point at the start: at the middle roll, or else anywhere.

    Anywhere alone where the roll is free.
    """
    if task.roll is None or targets.references is None:
        return (None,)
    t, b, psi = targets.references[cell], targets.approaches[cell], task.roll.middle
    return (np.cos(psi) * t + np.sin(psi) * np.cross(b, t), None)


def _window(robot: Robot) -> Array:
    """(2, n) the part of the limits that starts are drawn from, rad or m.

    At most one turn of each joint, about the middle of its limits (about zero, or next to its only
    limit, where it has none): further windings place the arm alike, and are nearer to a limit.
    """
    low, high = robot.lower.copy(), robot.upper.copy()
    free = np.isinf(low) & np.isinf(high)
    low[free], high[free] = -np.pi, np.pi
    low = np.where(np.isinf(low), high - 2.0 * np.pi, low)
    high = np.where(np.isinf(high), low + 2.0 * np.pi, high)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    half = np.where(robot.prismatic, half, np.minimum(half, np.pi))
    return np.stack([middle - half, middle + half])
