"""Replay of the greedy search's paths by Pinocchio, J-cell by J-cell.

Nothing of the search is used here: tool points come from Pinocchio, not from the compiled chain,
and what is checked are the paper's definitions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.cone import angle_of
from feasibility.paper.jcell_steps import Steps
from feasibility.search import Search
from feasibility.task import Task
from feasibility.verdict import Certificate, Replay, Verdict
from robots import Kinematics, Robot
from surfaces.patches import GridCells, closed_form_grid

SAME = 1e-9  # [rad], [m], [1]: rounding allowed where two computations of one number meet


@dataclass(frozen=True, eq=False, slots=True)
class Path:
    """One edge of the search: J-cells from one E-cell into a neighbouring one."""

    cell: int
    neighbour: int
    q: NDArray[np.float64]
    """(k, n) configurations of its J-cells, rad or m."""


def replay_tree(
    robot: Robot, cells: GridCells, task: Task, steps: Steps, paths: Sequence[Path]
) -> Replay:
    """Check that each path is what the search says: every J-cell, every step, both end cells.

    - each step is one J-cell move: of one joint, or of any for all moves;
    - every J-cell is inside the joint limits, the tolerance, the cone and the patch, with the
      margin that makes this true between J-cells too;
    - a path begins in its cell, where and how that cell was first entered, and ends in the
      neighbour.

    The `paths` are the edges of a tree, each after the edge that enters its cell.
    """
    faults: list[str] = []
    q = np.concatenate([path.q for path in paths]) if paths else np.empty((0, robot.n))
    last = np.cumsum([len(path.q) for path in paths], dtype=int) - 1
    first = last + 1 - np.array([len(path.q) for path in paths], dtype=int)

    moves = np.delete(np.diff(q, axis=0) / steps.size, last[:-1], axis=0)
    off_grid = np.abs(moves - np.round(moves)) * steps.size
    moved = np.abs(np.round(moves))
    count = moved.sum(axis=1)
    one = count >= 1 if steps.moves == "all" else count == 1
    if (off_grid > SAME).any() or (moved > 1).any() or not one.all():
        faults.append("a step is not one J-cell move")

    margin = np.minimum(q - robot.lower, robot.upper - q).min(initial=np.inf)
    if not margin >= 0.0:
        faults.append(f"a joint passes its limit by {-margin:.3g}")

    points, axes = Kinematics(robot).tools(q)
    closest_point = cells.surface.closest(points)
    sign = cells.surface.side_sign
    error = np.abs(closest_point.height - sign * task.standoff).max(initial=0.0) + steps.sag
    chord = np.linalg.norm(axes + sign * closest_point.normal, axis=1).max(initial=0.0) + steps.turn
    angle = angle_of(float(chord))
    if not closest_point.inside.all():
        faults.append("the tool point leaves the patch")
    if not error <= steps.tolerance:
        faults.append(
            f"the tool point deviates by {error:.3g} m, more than {steps.tolerance:.3g} m"
        )
    if task.cone_deg < 180.0 and not angle <= task.cone:
        faults.append(f"the tool axis tilts {np.degrees(angle):.4f} degrees out of the cone")

    at = np.column_stack([closest_point.u, closest_point.v])
    begins = within_cells(cells, at[first], [path.cell for path in paths])
    ends = within_cells(cells, at[last], [path.neighbour for path in paths])
    if not begins.all() or not ends.all():
        faults.append("a path does not begin or end in the cell it claims")
    if not _continuous(paths):
        faults.append("a path does not begin where its cell was entered")
    certificate = Certificate(len(q), float(error), float(angle), float(margin))
    return Replay(certificate, "; ".join(faults))


def within_cells(
    cells: GridCells, parameters: NDArray[np.float64], cell: Sequence[int]
) -> NDArray[np.bool_]:
    """(k,) whether points with surface parameters (k, 2), rad or m, lie in the cells (k,)."""
    surface = cells.surface
    centres = np.column_stack([cells.u, cells.v])  # (N, 2) rad or m
    ranges = np.array([surface.u_range, surface.v_range])
    half = 0.5 * np.diff(ranges, axis=1)[:, 0] / np.maximum(cells.shape, 1)
    away = parameters - centres[np.asarray(cell, dtype=int)]
    turned = (away + np.pi) % (2.0 * np.pi) - np.pi
    away = np.where([surface.u_closed, surface.v_closed], turned, away)
    return np.asarray((np.abs(away) <= half + SAME).all(axis=1))


def _continuous(paths: Sequence[Path]) -> bool:
    """True when each path begins where an earlier one entered its cell, or where all began."""
    if not paths:
        return True
    entered = {paths[0].cell: paths[0].q[0]}
    for path in paths:
        if path.cell not in entered or path.neighbour in entered:
            return False
        if not np.abs(path.q[0] - entered[path.cell]).max() <= SAME:
            return False
        entered[path.neighbour] = path.q[-1]
    return True


def replay_stored(verdict: Verdict, search: Search) -> Replay:
    """`replay_tree` of a verdict of the greedy search, with the settings of that search.

    Besides, every cell has to be in its tree.
    """
    cells = closed_form_grid(verdict.cells)
    steps = Steps.of(verdict.robot, cells.closed_form, verdict.task, search)
    edges = [] if verdict.tree is None else verdict.tree.edges(data="motion")
    paths = [Path(a, b, motion) for a, b, motion in edges]
    found = replay_tree(verdict.robot, cells, verdict.task, steps, paths)
    entered = set() if verdict.tree is None else set(verdict.tree.nodes)
    missed = len(cells) - len(entered)
    if missed:
        text = f"{missed} cells are not in the tree"
        return Replay(found.certificate, "; ".join(filter(None, (found.refusal, text))))
    return found
