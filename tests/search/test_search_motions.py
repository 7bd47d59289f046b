"""What the search stores holds: targets and their curves, configurations, motions, the walk."""

import numpy as np
import pytest
from arm_urdfs import FREE, joint
from bounds import holds
from plain import tools
from random_arms import QUESTIONS, planar_arm, robot_of
from search_kernels import assert_walked

from coverable import Search, Task, check, cylinder, plane, replay, sphere
from coverable.arrays import unit_along
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.arrays import arrays_of
from feasibility.roadmap.rounds import explore
from feasibility.roadmap.search import close
from feasibility.roadmap.walk import covering_walk
from feasibility.roll import projected
from feasibility.targets.curves import target_curves
from feasibility.verdict import Walk

DOME = sphere(1.0, (10, 90), (10, 180), rpy_deg=(30, 0, 20), position=(1, 2, 3)).cells(4, 5)
PIPE = cylinder(0.2, (0, 360), (0, 1), side="outside", rpy_deg=(0, 50, 0)).cells(6, 3)
TASKS = {
    "along u": Task(0.01, 20, roll_deg=(-15, 15)),
    "along z": Task(0.01, 20, roll_deg=(-15, 15), roll_reference=(0.3, 0.2, 1)),
    "held upright": Task(0.01, 20, roll_deg=(0, 0), approach=(0.2, 0.1, -1)),
    "all fixed": Task(0.01, 20, roll_deg=(0, 5), approach=(0, 0, -2), roll_reference=(1, 2, 0)),
}


def along(first, cubics, curves, t):
    """Piece, and value, first and second derivatives by t (k, 3) of cubics at t of curves (k,)."""
    count = np.diff(first)[curves]
    piece = np.minimum((t * count).astype(int), count - 1)
    s, c = (t * count - piece)[:, None], cubics[first[curves] + piece].swapaxes(0, 1)
    values = c[0] + s * (c[1] + s * (c[2] + s * c[3]))
    slopes = (c[1] + s * (2.0 * c[2] + s * 3.0 * c[3])) * count[:, None]
    bends = (2.0 * c[2] + 6.0 * s * c[3]) * count[:, None] ** 2
    return first[curves] + piece, (values, slopes, bends)


def frames_over(task, surface, u, v):
    """Approach directions and references (k, 3) over places, by the definition."""
    approach = -surface.side_sign * surface.normal(u, v)
    if task.approach is not None:
        approach = np.tile(surface.rotation @ unit_along(task.approach), (len(u), 1))
    along_u = surface.tangent(u, v)
    if task.roll_reference is not None:
        along_u = np.tile(surface.rotation @ unit_along(task.roll_reference), (len(u), 1))
    return approach, projected(along_u, approach)[0]


@pytest.mark.parametrize("cells", [DOME, PIPE], ids=["dome", "pipe"])
@pytest.mark.parametrize("name", TASKS)
def test_frames_follow_the_surface_within_their_bounds_and_turn_no_faster(name, cells):
    task, surface, rng = TASKS[name], cells.surface, np.random.default_rng(5)
    found = target_curves(cells, task)
    curves, t = rng.integers(0, len(cells.pairs), 2000), rng.random(2000)
    piece, (value, slope, bend) = along(found.first, found.frames.cubics, curves, t)
    _, (b, _, _) = along(found.first, found.cubics[:, :, 3:], curves, t)
    closest = surface.closest(cells.curves.at(curves, t)[0])
    approach, right = frames_over(task, surface, closest.u, closest.v)
    assert np.linalg.norm(b - approach, axis=1).max() <= found.deviations[:, 1].max() + 1e-12
    off = np.linalg.norm(value - right, axis=1)
    assert (off <= found.frames.deviations[curves] + 2 * found.deviations[curves, 1] + 1e-8).all()
    bounds = found.frames.derivative_bounds[piece]
    for truth, bound in ((slope, bounds[:, 0]), (bend, bounds[:, 1])):
        holds(bound + 1e-9, np.linalg.norm(truth, axis=1), 0.9 if bound.max() > 1e-6 else 0.0)
    # Beside a centre, on the target surface, in any direction.
    cell = rng.integers(0, len(cells), 500)
    x = np.column_stack([cells.u, cells.v])[cell]
    moved = [*x.T], [*(x + 1e-4 * rng.normal(size=x.shape)).T]
    height = surface.side_sign * task.standoff
    ends = [surface.point(*uv) + height * surface.normal(*uv) for uv in moved]
    refs = [frames_over(task, surface, *uv)[1] for uv in moved]
    step, turn = (np.linalg.norm(two[1] - two[0], axis=1) for two in (ends, refs))
    assert (turn <= found.frames.centre_curvature * step + 1e-8).all()


@pytest.mark.parametrize("short", [0.3, 0.99, 1.01])
def test_a_target_beyond_reach_is_covered_within_the_tolerance_and_no_further(short):
    """A planar arm of three links, and one small cell a share of the tolerance beyond its reach."""
    robot = planar_arm(3)
    (reach,), _ = tools(robot, np.zeros((1, 3)))
    x, size = reach[0] + short * 0.01, 0.02
    patch = plane((x - size, x + size), (reach[1] - size, reach[1] + size), side="outside")
    cells = patch.cells(1, 1)
    for seed in range(3 if short < 1.0 else 1):
        verdict = check(robot, cells, Task(0.0, 180.0, 0.01), Search(seed=seed))
        assert verdict.evidence == ("witness" if short < 1.0 else "proof")
        if short < 1.0:
            (point,), _ = tools(robot, verdict.witness.q[:1])
            assert 0.999 * short * 0.01 <= np.linalg.norm(point - cells.centres[0]) <= 0.01


@pytest.mark.parametrize(
    ("stroke", "tool", "feasible"),
    [((-3.9, -2.5), -3.0, True), ((-3.9, -2.5), 1.0, False), ((50.0, 60.0), 55.0, True),
     ((-np.inf, -2.5), -7.0, True), (FREE, 8.0, True)],
)  # fmt: skip
def test_a_slide_whose_stroke_lies_far_out(stroke, tool, feasible):
    """Guesses stay inside the limits, wherever these are; what is out of reach is proved so."""
    sliding = joint(1, "prismatic", axis=(1, 0, 0), limits=(-1, 1))
    robot = robot_of([sliding, joint(2)]).with_limits({"j1": stroke})
    cells = plane((tool - 0.1, tool + 0.1), (-1e-4, 1e-4), side="outside").cells(3, 1)
    guesses = Exploration(robot, cells, arrays_of(robot, cells, Task(0.0, 180)), 0).guesses(50)
    assert ((guesses >= robot.lower) & (guesses <= robot.upper)).all()
    verdict = check(robot, cells, Task(0.0, 180))
    assert (verdict.feasible, verdict.evidence) == (feasible, "witness" if feasible else "proof")


def refusal(robot, cells, task, q, first, last):
    """Why the replay refuses a motion from one cell's centre to another's; empty if it does not."""
    marks = np.full(len(q), -1)
    marks[0], marks[-1] = first, last
    return replay(robot, cells, task, Walk(q, marks), np.zeros(len(cells), dtype=bool)).refusal


@pytest.mark.parametrize("name", QUESTIONS)
def test_every_motion_that_a_search_stores_holds_and_the_walk_takes_them_alone(name):
    """Spread, explored and closed: edges run from node to node, and the judge accepts them."""
    robot, cells, task = QUESTIONS[name]
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), 0)
    explore(exploration)
    for cell in range(0, len(cells), 3):
        exploration.add_seeds(cell, exploration.guesses(3))
        exploration.explore_self_motions(cell)
    close(exploration)
    roadmap = exploration.roadmap
    assert len(roadmap.edges) >= len(cells) - 1
    for edge, (x, y, _) in enumerate(roadmap.edges):
        motion = roadmap.motion(edge)
        assert (motion[-1] == roadmap.q[y]).all()
        assert refusal(robot, cells, task, motion, roadmap.cell[x], roadmap.cell[y]) == ""
    order = assert_walked(roadmap, covering_walk(roadmap, exploration.best))
    assert set(order) == set(range(len(cells)))
    assert len(order) <= 1.4 * len(cells)
