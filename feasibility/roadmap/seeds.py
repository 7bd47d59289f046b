"""What a search is given to begin with: the arm's start, or a motion over cells like these."""

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array
from coverable.errors import ArgumentError, Checks, Fault
from feasibility.certification.faults import Replay
from feasibility.collisions.kernels.clearance import blamed, segment_clear
from feasibility.collisions.problem_bodies import Bodies
from feasibility.problem import Problem
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.search_arrays import SearchArrays
from feasibility.verdict import Walk
from robots.kinematics import Kinematics


def check_seeds(problem: Problem, seeds: Walk) -> None:
    """Refuse a motion of another arm, or over other cells.

    Raises:
        ArgumentError: it is one.
    """
    n, total = problem.robot.n, len(problem.cells)
    checks = Checks("seeds")
    if seeds.q.ndim != 2 or seeds.q.shape[1] != n or not np.isfinite(seeds.q).all():
        checks.wrong("q", seeds.q.shape, f"must be (m, {n}) finite numbers, one column per joint")
    if seeds.cell.shape != seeds.q.shape[:1] or (seeds.cell >= total).any():
        checks.wrong("cell", seeds.cell.shape, f"must be (m,) cells below {total}, or negative")
    checks.done()


def known_motion(problem: Problem, seeds: Walk) -> Replay | None:
    """The replay of the seeds, where they cover all cells already, marked and accepted."""
    marked = np.isin(np.arange(len(problem.cells)), seeds.cell)
    start = problem.robot.start
    if start is not None and not (len(seeds.q) and np.array_equal(seeds.q[0], start)):
        return None
    found = problem.replayed(seeds) if marked.all() else None
    return found if found is not None and found.accepted else None


def begin_at_start(exploration: Exploration, cell: int, bodies: Bodies | None) -> None:
    """Begin the search at the arm's start, which is over a cell.

    Raises:
        ArgumentError: bodies are nearer to each other there than they may be; or it is not over the
            first pose of a toolpath.
    """
    if exploration.cells.in_order and cell != 0:
        what = f"is over pose {cell}; a toolpath is run from its first pose, so begin there"
        raise ArgumentError([Fault("start", what)])
    arrays, start = exploration.arrays, np.array(exploration.robot.start)
    if bodies is not None and not segment_clear(arrays.collisions, start, start) > 0.0:
        raise ArgumentError([Fault("start", _collides(exploration, bodies, start))])
    exploration.begin_at(cell, start)


def _collides(exploration: Exploration, bodies: Bodies, start: NDArray[np.float64]) -> str:
    """Why a start (n,) is refused: for the shapes, or for the bodies around them alone."""
    from feasibility.certification.collisions.collision_replay import collision_replay

    judged = collision_replay(exploration.robot, bodies, start[None])
    if not judged.accepted:
        found = "; ".join(fault.text for fault in judged.faults)
        return f"collides, or is too near ({found}); choose another start"
    pair = bodies.pairs[int(blamed(exploration.arrays.collisions))]
    return (
        f"is clear, but the convex bodies that the search puts around {pair.first} and "
        f"{pair.second} are larger than their shapes, and collide; choose another start"
    )


def seed_cells(exploration: Exploration, seeds: Walk) -> None:
    """Seed the cells that a known motion passes, as long as the best component misses some.

    Where it has no marks, the rows with the tool point nearest to each cell are taken.
    """
    rows = {int(seeds.cell[row]): row for row in np.flatnonzero(seeds.cell >= 0)[::-1].tolist()}
    if not rows and len(seeds.q):
        tips, _ = Kinematics(exploration.robot).tools(seeds.q)
        for cell, point in enumerate(exploration.arrays.points):
            rows[cell] = int(np.linalg.norm(tips - point, axis=1).argmin())
    for cell, row in rows.items():
        if exploration.complete:
            return
        if not exploration.covered[cell]:
            exploration.add_seeds(cell, wound(exploration.arrays, seeds.q[row])[None])


def wound(arrays: SearchArrays, q: Array) -> Array:
    """(n,) the same placement of the arm, with windings that bring joints inside their limits."""
    turn = np.where(arrays.chain.prismatic, 0.0, 2.0 * np.pi)
    q = q + turn * np.ceil(np.maximum(arrays.lower - q, 0.0) / (2.0 * np.pi))
    q = q - turn * np.ceil(np.maximum(q - arrays.upper, 0.0) / (2.0 * np.pi))
    return np.clip(q, arrays.lower, arrays.upper)  # rounding
