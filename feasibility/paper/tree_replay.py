"""Replay of the greedy search's paths by Pinocchio, J-cell by J-cell.

Nothing of the search is used here: tool points and rolls come from Pinocchio, not from the compiled
chain, and what is checked are the paper's definitions, on the surface itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.faults import MotionFault, Replay
from feasibility.certification.motion_replay import replay_over_surface
from feasibility.cone import angle_of
from feasibility.paper.jcell_steps import Steps
from feasibility.paper.tree_and_graph import corners, there_and_back
from feasibility.roll import projected, roll_of
from feasibility.search_settings import Search
from feasibility.targets.references import u_directions
from feasibility.task import Task
from feasibility.verdict import Certificate, Verdict
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.patches.grid_cells import GridCells


def approaches_at(cells: Cells, task: Task, points: Array) -> Array:
    """(k, 3) approach directions b under tool points (k, 3) m: eq. (3)."""
    fixed = task.fixed_approach(cells)
    if fixed is not None:
        return np.broadcast_to(fixed, points.shape)
    return -cells.surface.side_sign * cells.surface.closest(points).normal


def rolls_at(kinematics: Kinematics, cells: Cells, task: Task, q: Array) -> Array:
    """(k,) rad, the angles about b from the reference direction on the surface to the TCP's.

    NaN where the surface has no reference direction.

    Args:
        kinematics: of the arm.
        cells: its surface counts.
        task: whose approach and reference count.
        q: (k, n) configurations, rad or m.
    """
    points, axes, x = kinematics.held(q)
    reference = task.fixed_reference(cells)
    if reference is None:
        reference = u_directions(cells.surface, points)
    if reference is None:
        return np.full(len(q), np.nan)
    b = approaches_at(cells, task, points)
    return roll_of(x, axes, projected(reference, b)[0], b)


SAME = 1e-9  # [rad], [m], [1]: rounding allowed where two computations of one number meet


@dataclass(frozen=True, eq=False, slots=True)
class Path:
    """One edge of the search: J-cells from one E-cell into a neighbouring one.

    The first of a tree, with which it begins, is one J-cell in one E-cell.
    """

    cell: int
    neighbour: int
    q: Array
    """(k, n) configurations of its J-cells, rad or m."""


def replay_tree(
    robot: Robot, cells: Cells, task: Task, steps: Steps, paths: Sequence[Path]
) -> Replay:
    """Check that each path is what the search says: every J-cell, every step, both end cells.

    - each step is one J-cell move: of one joint, or of any for all moves;
    - every J-cell is inside the joint limits, the tolerance, the cone and the surface, and so is
      the motion between them;
    - a path begins in its cell, where and how that cell was first entered, and ends in the
      neighbour;
    - the first begins at the arm's start, where it has one.

    Between J-cells, closed forms have a margin that makes this true; any other surface is left to
    the replay of motions over a surface.

    The `paths` are the J-cell that the tree begins with, and its edges, each after the edge that
    enters its cell.
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

    kinematics = Kinematics(robot)
    points, axes = kinematics.tools(q)
    begins = _over_cells(cells, points[first], [path.cell for path in paths])
    ends = _over_cells(cells, points[last], [path.neighbour for path in paths])
    if not begins.all() or not ends.all():
        faults.append("a path does not begin or end in the cell it claims")
    if not _continuous(paths):
        faults.append("a path does not begin where its cell was entered")
    if robot.start is not None and not np.abs(q[:1] - robot.start).max(initial=0.0) <= SAME:
        faults.append("it does not begin at the arm's start")
    roll = None
    if task.roll is not None:
        off = task.roll.off(rolls_at(kinematics, cells, task, q))
        roll = float(np.abs(off).max(initial=0.0))
        if not roll <= steps.roll[1] + SAME:
            faults.append("the tool rolls out of its range")
    if steps.triangles is None:
        error, angle, more = _by_margins(cells, task, steps, points, axes)
    else:
        error, angle, more = _by_surface(robot, cells, task, steps, [] if faults else paths)
    certificate = Certificate(len(q) - len(first[:1]), error, angle, float(margin))
    if roll is not None and task.roll is not None:
        between = task.roll.half - float(steps.roll[1])
        certificate = replace(certificate, max_roll=roll + between)
    return Replay(certificate, tuple(map(MotionFault, faults + more)))


def _by_margins(
    cells: Cells, task: Task, steps: Steps, points: Array, axes: Array
) -> tuple[float, float, list[str]]:
    """Error (m), tilt (rad) and faults of J-cells over a closed form, with the margin between."""
    faults = []
    closest_point = cells.surface.closest(points)
    sign, approaches = cells.surface.side_sign, approaches_at(cells, task, points)
    sag, turn = (float(margin.max(initial=0.0)) for margin in (steps.sag, steps.turn))
    error = float(np.abs(closest_point.height - sign * task.standoff).max(initial=0.0) + sag)
    chord = float(np.linalg.norm(axes - approaches, axis=1).max(initial=0.0) + turn)
    angle = angle_of(chord)
    if not closest_point.inside.all():
        faults.append("the tool point leaves the patch")
    if not error <= steps.tolerance:
        faults.append(
            f"the tool point deviates by {error:.3g} m, more than {steps.tolerance:.3g} m"
        )
    if task.cone_deg < 180.0 and not angle <= task.cone:
        faults.append(f"the tool axis tilts {np.degrees(angle):.4f} degrees out of the cone")
    return error, angle, faults


def _by_surface(
    robot: Robot, cells: Cells, task: Task, steps: Steps, paths: Sequence[Path]
) -> tuple[float, float, list[str]]:
    """Error (m), tilt (rad) and faults of one motion along all paths, there and back."""
    import networkx as nx

    if not paths:
        return 0.0, 0.0, []
    tree: nx.DiGraph = nx.DiGraph()
    tree.add_node(paths[0].cell, q=paths[0].q[0])
    tree.add_edges_from((path.cell, path.neighbour, {"motion": path.q}) for path in paths[1:])
    rows = corners(there_and_back(tree, paths[0].cell))
    used = replace(task, tolerance=steps.tolerance)
    found = replay_over_surface(robot, cells, used, rows, np.zeros(len(cells), dtype=bool))
    certificate = found.certificate
    return certificate.max_position_error, certificate.max_angle, list(map(str, found.faults))


def _over_cells(cells: Cells, points: Array, which: Sequence[int]) -> Mask:
    """(k,) whether points (k, 3) m are over the cells (k,)."""
    if not isinstance(cells, GridCells):
        return np.asarray(cells.locate(points) == np.asarray(which, dtype=np.int64))
    found = cells.surface.closest(points)
    return within_cells(cells, np.column_stack([found.u, found.v]), which)


def within_cells(cells: GridCells, parameters: Array, cell: Sequence[int]) -> Mask:
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
    for path in paths[1:]:
        if path.cell not in entered or path.neighbour in entered:
            return False
        if not np.abs(path.q[0] - entered[path.cell]).max() <= SAME:
            return False
        entered[path.neighbour] = path.q[-1]
    return True


def replay_stored(verdict: Verdict, search: Search) -> Replay:
    """`replay_tree` of a verdict of the greedy search, with the settings of that search.

    Besides, its configurations have to be those that its motions lead to, and every cell has to be
    in its tree.
    """
    robot, cells, task = verdict.robot, verdict.cells, verdict.task
    paths = _paths_of(verdict)
    if isinstance(paths, str):
        return Replay(Certificate(0, np.nan, np.nan, np.nan), (MotionFault(paths),))
    found = replay_tree(robot, cells, task, Steps.of(robot, cells, task, search), paths)
    missed = len(cells) - len(paths)
    if missed and found.accepted:
        return replace(found, faults=(MotionFault(f"{missed} cells are not in the tree"),))
    return found


def _paths_of(verdict: Verdict) -> list[Path] | str:
    """The paths of a verdict's tree for `replay_tree`; or why it is none."""
    tree, start = verdict.tree, verdict.start
    if tree is None or start is None or start not in tree:
        return "it has no tree that begins in a cell"
    q = dict(tree.nodes(data="q"))
    motions = [Path(a, b, motion) for a, b, motion in tree.edges(data="motion")]
    if any(known is None for known in (*q.values(), *(path.q for path in motions))):
        return "a cell or an edge of its tree has no configurations"
    paths = [Path(start, start, np.atleast_2d(q[start])), *motions]
    if sorted(path.neighbour for path in paths) != sorted(tree):
        return "its tree does not enter each of its cells once"
    if any(not np.abs(q[path.neighbour] - path.q[-1]).max() <= SAME for path in paths):
        return "a cell's configuration is not the one that its motion leads to"
    return paths
