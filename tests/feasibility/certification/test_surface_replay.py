"""The replay over a surface: motions of other makes are accepted, damaged ones are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dense_replay import dense
from rasters import SURFACES, followed, raster
from small_cases import paper_verdict

from feasibility import Task, check, verify
from feasibility.certification import replay_over_surface
from robots import Kinematics, load_robot
from surfaces import mesh, piecewise, plane, poses
from surfaces.meshes import TriangleMesh

FEASIBLE_PAPER_CASES = ("4a", "4b", "4c", "4e", "5a", "5b", "5c", "5d", "5e", "5f")


@pytest.fixture(params=SURFACES)
def made(request):
    """A motion made by other means."""
    return raster(request.param)


def heights(cells, task, robot, q):
    """What dense samples show: how far the tool is off the offset surface, and its tilt's chord."""
    points, axes = Kinematics(robot).tools(q)
    sign = cells.surface.side_sign
    found = cells.surface.closest(points)
    return (
        np.abs(found.height - sign * task.standoff),
        np.linalg.norm(axes + sign * found.normal, axis=1),
    )


def test_rasters_are_accepted(made):
    outcome = replay_over_surface(*made)
    assert outcome.accepted, outcome.refusal
    assert outcome.reached.all()
    assert outcome.certificate.min_limit_margin > 0.0
    if made.cells.surface.mean_edge_length == 0.0:  # there the normal leads to the closest point
        off, _ = heights(made.cells, made.task, made.robot, dense(made.q, 5))
        assert off.max() <= outcome.certificate.max_position_error + 1e-9


@pytest.mark.parametrize("name", FEASIBLE_PAPER_CASES)
def test_witnesses_of_the_paper_cases_are_accepted(name):
    verdict = paper_verdict(name)
    assert verdict.feasible
    outcome = replay_over_surface(verdict.robot, verdict.cells, verdict.task, verdict.witness.q)
    assert outcome.accepted, outcome.refusal


# -- damages: each returns (robot, cells, task, q) and a word of the refusal ----------------------


def moved_along(made, row, distance):
    """Rows with one moved so that the tool goes away from the surface by a distance (m)."""
    q = made.q.copy()
    kinematics = Kinematics(made.robot)
    jacobian, turn = kinematics.jacobians(q[row])
    _, axis = kinematics.tool(q[row])
    step = np.linalg.pinv(np.vstack([jacobian, turn])) @ np.concatenate([axis, np.zeros(3)])
    q[row] -= distance * step
    return q


def by_two_tolerances(made):
    q = moved_along(made, len(made.q) // 2, 2 * made.task.tolerance)
    return replace_q(made, q), "tool point is"


def columns_swapped(made):
    order = [1, 0, 2, 3, 4, 5]
    return replace_q(made, made.q[:, order]), "tool point is"


def other_limits(made):
    table = np.column_stack([made.robot.lower, made.robot.upper])
    table[2, 1] = made.q[:, 2].max() - 0.01
    return made._replace(robot=made.robot.with_limits(table)), "passes its limit by 0.573 deg"


def narrower_cone(made):
    # Rasters hold the tool upright, but for the crease.
    tilted = turned(replace_q(made, made.q[:40]), np.radians(9.0))
    task = replace(made.task, cone_deg=8.9)
    return replace_q(made, tilted)._replace(task=task), "tilts"


def turned(made, angle):
    """Rows with the tool turned away from the normal."""
    kinematics, q = Kinematics(made.robot), made.q.copy()
    for row in range(len(q)):
        point, axis = kinematics.tool(q[row])
        side = np.cross(axis, [0.3, 0.5, 0.7])
        side /= np.linalg.norm(side)
        goal = np.cos(angle) * axis + np.sin(angle) * side
        for _ in range(8):
            at, now = kinematics.tool(q[row])
            jacobian, turn = kinematics.jacobians(q[row])
            off = np.concatenate([point - at, goal - now])
            q[row] += np.linalg.lstsq(np.vstack([jacobian, turn]), off, rcond=1e-6)[0]
    return q


def last_cell_missed(made):
    points, _ = Kinematics(made.robot).tools(made.q)
    aims = made.task.targets(made.cells).points
    near = np.linalg.norm(points[:, None] - aims, axis=2).min(axis=0)
    assert near.max() < made.task.tolerance
    return replace_q(made, made.q[:-12]), "never reached"


def rows_taken_out(made):
    """A long straight cut between two rows that are good passes the cells between them by."""
    keep = np.r_[0 : len(made.q) // 3, 2 * len(made.q) // 3 : len(made.q)]
    return replace_q(made, made.q[keep]), "never reached"


def a_shoulder_that_goes_on(made):
    q = np.vstack([made.q, made.q[-1] + [0, 0.3, 0, 0, 0, 0]])
    return replace_q(made, q), "tool point is"


def other_side(made):
    surface = made.cells.surface
    flipped = "inside" if surface.side == "outside" else "outside"
    return made._replace(cells=replace(made.cells, surface=replace(surface, side=flipped))), "tilts"


def other_standoff(made):
    task = replace(made.task, standoff=made.task.standoff + 2 * made.task.tolerance)
    return made._replace(task=task), "tool point is"


def shifted_surface(made):
    surface = made.cells.surface.moved(np.eye(3), [0.0, 0.0, 2.5e-3])
    return made._replace(cells=replace(made.cells, surface=surface)), "tool point is"


def not_a_number(made):
    q = made.q.copy()
    q[7, 3] = np.nan
    return replace_q(made, q), "row 8: wrist_1_joint is not a finite number"


def degrees(made):
    return replace_q(made, np.degrees(made.q)), "passes its limit"


def a_joint_short(made):
    return replace_q(made, made.q[:, :5]), "no motion of 6 joints"


def nothing(made):
    return replace_q(made, made.q[:0]), "never reached"


def wiggle_between_rows(made):
    """A row is moved off and two good ones put beside it, so that only a sliver is bad."""
    k = len(made.q) // 2
    bad = moved_along(made, k, 1.5 * made.task.tolerance)[k]
    q = np.vstack([made.q[: k + 1], bad, made.q[k:]])
    return replace_q(made, q), f"row {k + 2}"


def replace_q(made, q):
    return made._replace(q=q)


DAMAGES = (
    by_two_tolerances, columns_swapped, other_limits, narrower_cone, last_cell_missed,
    rows_taken_out, a_shoulder_that_goes_on, other_side, other_standoff, shifted_surface,
    not_a_number, degrees, a_joint_short, nothing, wiggle_between_rows,
)  # fmt: skip


NAMES = tuple(SURFACES)
DAMAGED = [(NAMES[(i + k) % len(NAMES)], d) for k, d in enumerate(DAMAGES) for i in (0, 1, 3, 5)]


@pytest.mark.parametrize(("name", "damage"), DAMAGED, ids=lambda one: getattr(one, "__name__", one))
def test_damaged_rasters_are_refused(name, damage):
    """The right reason each time; 15 damages to 4 motions each."""
    damaged, word = damage(raster(name))
    outcome = replay_over_surface(*damaged)
    assert not outcome.accepted
    assert word in outcome.refusal, outcome.refusal


def test_a_whole_turn_of_the_last_joint_is_no_fault_of_its_own():
    """Poses of the tool's axis do not change by it: what was good stays good, if limits allow."""
    made = raster("plane")
    q = made.q.copy()
    q[len(q) // 2 :, 5] -= np.sign(q[:, 5].mean()) * 2 * np.pi
    outcome = replay_over_surface(made.robot, made.cells, made.task, q)
    assert outcome.accepted == bool((q >= made.robot.lower).all() and (q <= made.robot.upper).all())


# -- between rows ----------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [0.9, 0.98, 0.999, 1.001, 1.02, 1.2, 3.0])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-3, 1e-2])
def test_a_motion_that_is_bad_only_between_two_rows(factor, tolerance):
    """UR5's base alone turns: the tool runs on a circle, and both rows lie on the plane x = c.

    The largest deviation is that of the circle's arc from its chord, known in closed form, so both
    sides of the border can be asked: a tenth of a percent less is accepted, more is refused.
    """
    robot = load_robot("ur5")
    kinematics = Kinematics(robot)
    # A pose with the tool axis level and pointing along the radius.
    base = np.array([0.0, -1.2, 1.6, -0.4, -np.pi / 2, 0.0])
    point, _ = kinematics.tool(base)
    radius = np.hypot(*point[:2])
    half = np.arccos(1.0 - factor * tolerance / radius)
    turn = np.arctan2(point[1], point[0])
    rows = np.array([base, base])
    rows[:, 0] = [-turn - half, -turn + half]
    wall = radius * np.cos(half)  # both ends are exactly on x = wall
    face = plane(
        (-0.3, 0.3), (-0.3, 0.3), side="outside", position=(wall, 0.0, point[2]), rpy_deg=(0, 90, 0)
    )
    task = Task(standoff=0.0, cone_deg=180, tolerance=tolerance)
    nobody = np.zeros(1, dtype=bool)
    outcome = replay_over_surface(robot, face.cells(1, 1), task, rows, nobody)
    assert outcome.accepted == (factor < 1.0), outcome.refusal
    if factor > 1.0:
        fault = outcome.faults[0]
        assert 0.0 < fault.share < 1.0
        assert "row 1 to 2" in outcome.refusal
        assert "tool point is" in outcome.refusal


# -- places that jump -----------------------------------------------------------------------------


LEVEL = 0.31  # m, where the tool of the raster over the plane is


def two_plates(gap):
    """Two flat pieces, one above the other."""
    levels = LEVEL, LEVEL + gap
    lower, upper = (plane((0.35, 0.55), (-0.1, 0.1), position=(0, 0, z)) for z in levels)
    return piecewise([lower, upper], side="outside")


def scroll(gap, turns=2):
    """A mesh like a rolled sheet, flat on top: two sheets above each other, joined far away."""
    flat = np.linspace(0.3, 0.6, 31)
    ring = np.linspace(0.0, 1.0, 41)[1:-1]
    x, z = [flat], [np.full(31, LEVEL)]
    # From the end of the lower sheet below and around to the beginning of the upper one.
    angle = np.pi / 2 - 2 * np.pi * ring
    centre, size = 0.45, 0.25
    x.append(centre + size * np.cos(angle) + 0.15 * (1 - 2 * ring))
    z.append(LEVEL - size + size * np.sin(angle) + gap * ring)
    x.append(flat)
    z.append(np.full(31, LEVEL + gap))
    line = np.stack([np.concatenate(x), np.concatenate(z)], axis=1)
    width = np.linspace(-0.1, 0.1, 9)
    points = np.stack(
        [
            np.repeat(line[:, :1], 9, 1),
            np.tile(width, (len(line), 1)),
            np.repeat(line[:, 1:], 9, 1),
        ],
        axis=-1,
    )
    corner = (np.arange(len(line) - 1)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate(
        [
            np.column_stack([corner, corner + 9, corner + 10]),
            np.column_stack([corner, corner + 10, corner + 1]),
        ]
    )
    return mesh(TriangleMesh(points.reshape(-1, 3), faces))


@pytest.mark.parametrize("made_of", ["pieces", "mesh"])
def test_a_jump_between_two_sheets_is_refused(made_of):
    """Both are within the tolerance half way, but no path on the surface leads across."""
    gap, tolerance = 1.5e-3, 1e-3
    made = raster("plane")
    cells = two_plates(gap).cells((4, 5)) if made_of == "pieces" else scroll(gap).cells(count=40)
    task = Task(standoff=0.0, cone_deg=20, tolerance=tolerance)
    nobody = np.zeros(len(cells), dtype=bool)
    lower = made.q
    kept = replay_over_surface(made.robot, cells, task, lower, nobody)
    assert kept.accepted, kept.refusal
    away = moved_along(made, len(lower) - 1, gap)[-1]
    there = replay_over_surface(made.robot, cells, task, np.vstack([away, away]), nobody)
    assert there.accepted, there.refusal
    outcome = replay_over_surface(made.robot, cells, task, np.vstack([lower, away]), nobody)
    assert not outcome.accepted
    assert "jumps" in outcome.refusal


def test_over_a_pole_and_around_a_closed_surface():
    """Straight over the pole of a ball, and once around it and on across the seam of its angle."""
    made = raster("ball")
    surface = made.cells.surface
    robot, task = made.robot, made.task
    kinematics = Kinematics(robot)
    height = surface.lengths[0] + task.standoff
    for polar, azimuth in (
        (np.linspace(0.8, -0.8, 400), np.full(400, 0.7)),  # over the pole
        (np.linspace(0.8, -0.8, 401), np.full(401, -2.0)),  # with one row on it
        (np.full(900, 0.5), np.linspace(0.3, 0.3 + 7.0, 900)),  # around
    ):
        normal = np.stack(
            [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1
        )
        points = surface.position + height * normal
        away = np.linalg.norm(kinematics.tools(made.q)[0] - points[0], axis=1)
        rows = followed(robot, points, -normal, made.q[np.argmin(away)])
        assert rows is not None
        nobody = np.zeros(len(made.cells), dtype=bool)
        outcome = replay_over_surface(robot, made.cells, task, rows, nobody)
        assert outcome.accepted, outcome.refusal


def test_beyond_the_border_the_place_stays_on_it():
    """Within the tolerance of the border's targets is on the surface; a little more is not."""
    made = raster("plane")
    nobody = np.zeros(len(made.cells), dtype=bool)
    surface = made.cells.surface
    for by, good in ((0.9e-3, True), (1.1e-3, False)):
        points, _ = Kinematics(made.robot).tools(made.q)
        low = points[:, 0].min()
        smaller = replace(surface, u_range=(low + by, surface.u_range[1]))
        outcome = replay_over_surface(
            made.robot, replace(made.cells, surface=smaller), made.task, made.q, nobody
        )
        assert outcome.accepted == good, outcome.refusal


def test_a_cell_reached_between_rows_counts():
    """The tool passes a centre between two rows that are both beside it."""
    made = raster("plane")
    keep = np.arange(len(made.q)) % 3 == 1
    keep[[0, -1]] = True
    task = replace(made.task, tolerance=4e-4)
    inner = np.zeros(made.cells.shape, dtype=bool)
    inner[:, 1:-1] = (
        True  # at the ends of its lines the raster turns, and rows taken out cut across
    )
    outcome = replay_over_surface(made.robot, made.cells, task, made.q[keep], inner.ravel())
    assert outcome.accepted, outcome.refusal
    points, _ = Kinematics(made.robot).tools(made.q[keep])
    aims = task.targets(made.cells).points[inner.ravel()]
    assert np.linalg.norm(points[:, None] - aims, axis=2).min(axis=0).max() > task.tolerance


def test_faults_say_where_and_by_how_much():
    made = raster("plane")
    k = 321
    q = moved_along(made, k, 2.3e-3)
    outcome = replay_over_surface(made.robot, made.cells, made.task, q)
    (fault,) = [fault for fault in outcome.faults if "tool point" in fault.text]
    assert fault.row == k
    assert fault.share == 0.0
    assert str(fault).startswith("row 322: the tool point is 2.30")
    assert fault.text.endswith("mm off its surface, 1 mm are allowed")


def test_no_cells_and_single_rows():
    made = raster("plane")
    first = made.q[:1]
    alone = replay_over_surface(made.robot, made.cells, made.task, first)
    assert alone.reached.sum() == 1
    assert not alone.accepted
    none = plane((0.35, 0.55), (-0.1, 0.1), side="outside", position=(0, 0, 0.3)).cells(0, 3)
    assert replay_over_surface(made.robot, none, made.task, first).accepted
    assert replay_over_surface(made.robot, none, made.task, made.q[:0]).accepted


def test_long_ways_of_a_toolpath_are_followed_where_they_are():
    """Poses of other passes, and of those that are crossed, are nearer than both ends."""
    x, y = np.linspace(0.4, 0.6, 9), np.linspace(-0.1, 0.1, 9)
    square = [(0.4, -0.1), (0.6, -0.1), (0.6, 0.1), (0.4, 0.1)]
    down = [(0.5, each) for each in y[::-1]]
    across = [(each, 0.0) for each in x]
    flat = np.array([*square, *down, (0.4, -0.1), *across])
    line = poses(
        np.column_stack([flat, np.full(len(flat), 0.2)]), np.tile([0.0, 0.0, 1.0], (len(flat), 1))
    )
    robot, task = load_robot("ur5"), Task(0.02, 20, 5e-4)
    verdict = check(robot, line, task)
    assert verdict.feasible
    q, marks = verdict.witness.q, verdict.witness.cell
    assert verify(robot, line, task, q, marks=marks).holds
    assert not verify(robot, line, task, q[len(q) // 2 :]).holds
    ahead = np.flatnonzero(marks == 3)[0] + 1  # three sides of the square, which cross nothing
    few = poses(line.surface.points[:4], line.surface.outward[:4])
    assert verify(robot, few, task, q[:ahead]).holds
