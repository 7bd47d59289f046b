"""The judges of motions: what is right is accepted, damages are refused, and figures are bounds."""

from dataclasses import replace

import numpy as np
import pytest
from capsule_arms import at as placed
from capsule_arms import bodies_of, pair
from gantry import SURFACES, configurations, gantry, marks_of, places_along, raster, tools_of
from referee import Facets, unit
from referee import evenly as dense
from samples import sampled, spread

from coverable import Obstacle, Task, load_robot, piecewise, plane, poses, replay, sphere, verify
from feasibility.certification.motion_replay import replay_over_surface
from feasibility.verdict import Walk
from robots.kinematics import Kinematics
from robots.shapes.bodies import Solid
from robots.urdf.link_shapes import Sphere


def off_and_tilt(cells, task, q):
    """(k,) m off the offset surface, and (k,) rad between tool and normal at the closest point."""
    (points, axes), surface = tools_of(q), cells.surface
    sign = surface.side_sign
    if surface.kind == "mesh":
        facets = Facets(surface.mesh.vertices, surface.mesh.faces, sign > 0.0)
        (found,) = facets.over(points, task.standoff)
        normal = found.normals
        off = np.linalg.norm(points - found.points - sign * task.standoff * normal, axis=1)
    else:
        found = surface.closest(points)
        normal, off = found.normal, np.abs(found.height - sign * task.standoff)
    chord = np.linalg.norm(axes + sign * normal, axis=1)
    return off, 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))


def leaning(name, angle):
    made = raster(name)
    points, axes = places_along(made.cells, made.task)
    side = unit(np.cross(axes, [0.3, 0.5, 0.7]))
    q = configurations(points, np.cos(angle) * axes + np.sin(angle) * side)
    return made._replace(q=q)


def off_by(made, row, distance):
    """Rows with one moved so that the tool goes away from the surface by a distance (m)."""
    q = made.q.copy()
    q[row, :3] -= distance * tools_of(q[row : row + 1])[1][0]
    return q


def ask(made, q=None, cell=None, **changes):
    q, cell = made.q if q is None else q, marks_of(made) if cell is None else cell
    needed = np.ones(len(made.cells), dtype=bool)
    return replay(made.robot, made.cells, replace(made.task, **changes), Walk(q, cell), needed)


@pytest.fixture(params=SURFACES)
def made(request):
    return raster(request.param)


@pytest.mark.parametrize("name", SURFACES)
def test_figures_bound_what_dense_samples_find_and_hardly_more(name):
    made = leaning(name, np.radians(9.0))
    found = replay_over_surface(*made)
    assert found.accepted, found.refusal
    assert found.reached.all()
    figures = found.certificate
    margin = min((made.q - made.robot.lower).min(), (made.robot.upper - made.q).min())
    assert figures.min_limit_margin == pytest.approx(margin, abs=1e-12)
    assert figures.waypoints == len(made.q)
    back = ask(made, made.q[::-1], marks_of(made)[::-1])
    assert back.accepted, back.refusal
    assert back.certificate.max_position_error == pytest.approx(figures.max_position_error)
    assert figures.max_position_error <= made.task.effective_tolerance
    if name == "sheets":  # at a crease normals do not lead to the closest point
        return
    off, tilt = off_and_tilt(made.cells, made.task, dense(made.q, 10))
    assert off.max() <= figures.max_position_error + (1e-7 if name == "mesh" else 1e-12)
    assert tilt.max() - 1e-9 <= figures.max_angle <= 1.02 * tilt.max()
    for share, accepted in ((1.0 + 1e-6, True), (0.97, False)):
        limits = {"cone_deg": float(share * np.degrees(figures.max_angle))}
        assert ask(made, **limits).accepted == accepted
        if off.max() > 1e-9:
            error = figures.max_position_error if accepted else off.max()
            assert ask(made, tolerance=max(share * error, 1e-9)).accepted == accepted


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_row_that_is_off_is_named_with_its_distance_whatever_its_mark(made, share):
    row = round(share * (len(made.q) - 1))
    q = off_by(made, row, 1.5 * made.task.tolerance)
    cell = marks_of(made)
    for mark in (cell[row], (cell[0] + 7) % len(made.cells)):
        cell[row] = mark
        found = replay_over_surface(*made[:3], q, marks=cell)
        (fault,) = (fault for fault in found.faults if "tool point" in fault.text)
        assert str(fault).startswith(f"row {row + 1}: the tool point is 1.5 mm off")


def replaced(**values):
    return lambda made: made._replace(**{k: change(made) for k, change in values.items()})


def with_nan(made):
    q = made.q.copy()
    q[7, 3] = np.nan
    return q


def passing(made):
    table = np.column_stack([made.robot.lower, made.robot.upper])
    table[2, 1] = made.q[:, 2].max() - 0.01
    return made.robot.with_limits(table)


def surfaced(**changes):
    return lambda made: replace(made.cells, surface=replace(made.cells.surface, **changes))


def wiggle(made):
    k = len(made.q) // 2
    bad = off_by(made, k, 1.5 * made.task.tolerance)[k]
    return np.vstack([made.q[: k + 1], bad, made.q[k:]])


DAMAGES = {
    "other columns": (replaced(q=lambda made: made.q[:, [1, 0, 2, 3, 4, 5]]), "tool point is"),
    "a limit": (replaced(robot=passing), "j3 passes its limit by 10 mm"),
    "the end": (replaced(q=lambda made: made.q[:-12]), "never reached"),
    "other side": (replaced(cells=surfaced(side="inside")), "tilts"),
    "other standoff": (replaced(task=lambda made: replace(made.task, standoff=0.014)),
                       "tool point is"),
    "NaN": (replaced(q=with_nan), "row 8: j4 is not a finite number"),
    "degrees": (replaced(q=lambda made: 60.0 * made.q), "passes its limit"),
    "a joint short": (replaced(q=lambda made: made.q[:, :5]), "no motion of 6 joints"),
    "nothing": (replaced(q=lambda made: made.q[:0]), "never reached"),
    "a row that wiggles": (replaced(q=wiggle), "tool point is 1.5 mm"),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_rasters_are_refused(made, damage):
    change, word = DAMAGES[damage]
    outcome = replay_over_surface(*change(made))
    assert not outcome.accepted
    assert word in outcome.refusal


def test_marks_are_checked(made):
    cell, misplaced = marks_of(made), "is not at its centre's target"
    rows = np.flatnonzero(cell >= 0)
    first, other = rows[0], rows[cell[rows] != cell[rows[0]]][0]
    assert ask(made).accepted
    for where, what in (
        (first, cell[other]), ([first, other], cell[[other, first]]),
        (np.flatnonzero(cell < 0)[3], cell[other]),
    ):  # fmt: skip
        wrong = cell.copy()
        wrong[where] = what
        assert misplaced in ask(made, cell=wrong).refusal
    unmarked = ask(made, cell=np.where(cell == cell[other], -1, cell))
    assert unmarked.accepted  # it is reached, whether it is marked or not
    for impossible in (len(made.cells), -2, 10**9):
        wrong = cell.copy()
        wrong[first] = impossible
        assert "not one of" in ask(made, cell=wrong).refusal
    assert "have cells of shape" in ask(made, made.q[1:], cell).refusal


def test_a_turn_more_in_one_joint(made):
    """The tool does not notice 2 pi between two rows; the motion would, but for its own axis."""
    k = len(made.q) // 2
    for j in (3, 4, 5):
        q = made.q.copy()
        q[k:, j] += 2.0 * np.pi
        free = made.robot.with_limits(np.full((6, 2), [-np.inf, np.inf]))
        assert replay_over_surface(free, made.cells, made.task, q).accepted == (j == 5)


@pytest.mark.parametrize("factor", [0.9, 0.999, 1.001, 3.0])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-2])
def test_a_motion_that_is_bad_only_between_two_rows(factor, tolerance):
    """UR5's base alone turns: the tool runs on a circle, and both rows lie on the plane x = c."""
    robot = load_robot("ur5")
    base = np.array([0.0, -1.2, 1.6, -0.4, -np.pi / 2, 0.0])
    point, _ = Kinematics(robot).tool(base)
    radius, turn = np.hypot(*point[:2]), np.arctan2(point[1], point[0])
    half = np.arccos(1.0 - factor * tolerance / radius)
    rows = np.array([base, base])
    rows[:, 0] = [-turn - half, -turn + half]
    at = (radius * np.cos(half), 0.0, point[2])  # both ends are exactly on the plane
    face = plane((-0.3, 0.3), (-0.3, 0.3), side="outside", position=at, rpy_deg=(0, 90, 0))
    task = Task(standoff=0.0, cone_deg=180, tolerance=tolerance)
    outcome = replay_over_surface(robot, face.cells(1, 1), task, rows, np.zeros(1, dtype=bool))
    assert outcome.accepted == (factor < 1.0), outcome.refusal
    if factor > 1.0:
        assert 0.0 < outcome.faults[0].share < 1.0
        assert "row 1 to 2" in outcome.refusal
        assert "tool point is" in outcome.refusal


@pytest.mark.parametrize("cone", [15.0, 5.0])
def test_the_figure_of_a_single_cell_is_that_of_the_closest_point_inside_the_cone(cone):
    """Beside the only centre of a small ball the normal turns; 4 mm aside it does by 10 deg."""
    ball = sphere(0.02, (0, 30), (0, 360), side="outside", position=(0.5, 0.1, 0.4)).cells(1, 1)
    target = Task(0.002, cone).targets(ball).points[0]
    normal = (target - [0.5, 0.1, 0.4]) / 0.022
    point = target + 0.004 * unit(np.cross(normal, [0.3, 0.5, 0.7]))
    q = configurations(point[None], -normal[None])
    task, needed = Task(0.002, cone, 5e-3), np.ones(1, dtype=bool)
    found = replay(gantry(), ball, task, Walk(q, np.array([0])), needed)
    turn = np.arctan(4.0 / 22.0)
    assert found.accepted
    assert found.certificate.max_angle == pytest.approx(turn if cone > 10.0 else 0.0, abs=1e-6)


LEVEL = 0.31  # m, where the tool of the raster over the plane is


def test_a_jump_between_two_sheets_is_refused():
    """Both are within the tolerance half way, but no path on the surface leads across."""
    gap, made = 1.5e-3, raster("plane")
    plates = [plane((0.35, 0.55), (-0.1, 0.1), position=(0, 0, LEVEL + z)) for z in (0.0, gap)]
    cells = piecewise(plates, side="outside").cells((4, 5))
    task = Task(standoff=0.0, cone_deg=20, tolerance=1e-3)
    away = off_by(made, len(made.q) - 1, gap)[-1:]

    def judged(rows):
        return replay_over_surface(made.robot, cells, task, rows, np.zeros(len(cells), dtype=bool))

    for rows in (made.q, np.vstack([away, away])):
        assert judged(rows).accepted
    outcome = judged(np.vstack([made.q, away]))
    assert not outcome.accepted
    assert "jumps" in outcome.refusal


def round_an_edge(side, turn, reach=0.02, lean=0.0):
    """Two plates that meet at an edge, the second bent up by a turn (rad); rows over both.

    In between in an arc `reach` (m) from the edge, with the tool ahead or behind by `lean` (rad).
    """
    plates = [plane((0.0, 0.1), (-0.1, 0.1))]
    plates += [plane((-0.1, 0.0), (-0.1, 0.1), rpy_deg=(0, np.degrees(turn), 0))]
    cells = piecewise(plates, side=side, position=(0.45, 0.0, 0.3)).cells((2, 3))
    sign = 1.0 if side == "outside" else -1.0

    def up(angles):
        return np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=-1)

    along = np.linspace(0.09, 0.0, 40)[:, None]
    angles = np.concatenate([np.zeros(40), np.linspace(0.0, turn, 41)[1:-1], np.full(40, turn)])
    first, last = np.cos([0.0, turn]), np.sin([0.0, turn])
    ways = [np.array([c, 0.0, -s]) for c, s in zip(first, last, strict=True)]
    feet = np.concatenate([along * ways[0], np.zeros((39, 3)), -along[::-1] * ways[1]])
    heights = np.where(np.arange(119) // 40 == 1, reach, 0.02)[:, None]
    heights[[40, 78]] = 0.02
    points = cells.surface.position + feet + sign * heights * up(angles)
    return cells, configurations(points, -sign * up(angles + lean))


@sampled(("side", "turn"), spread([("outside", -1.0), ("outside", -0.7), ("inside", 1.0)], 2))
def test_round_an_outer_edge_the_tool_keeps_its_distance_from_the_edge(side, turn):
    task = Task(standoff=0.02, cone_deg=20, tolerance=1e-3)

    def judged(*how):
        cells, rows = round_an_edge(side, turn, *how)
        return replay_over_surface(gantry(), cells, task, rows, np.zeros(len(cells), dtype=bool))

    for how in ((), (0.0209,), (0.0191,), (0.02, 0.34), (0.02, -0.34)):
        found = judged(*how)
        assert found.accepted, found.refusal
        lean = how[1] if len(how) > 1 else 0.0
        assert found.certificate.max_angle == pytest.approx(abs(lean), abs=2e-3)
    for how in ((0.0211,), (0.0189,), (0.02, 0.36), (0.02, -0.36)):
        assert not judged(*how).accepted
    cells, rows = round_an_edge(side, turn)
    straight = np.concatenate([rows[:40], rows[79:]])  # from one plate to the other at once
    found = replay_over_surface(gantry(), cells, task, straight, np.zeros(12, dtype=bool))
    assert "is not known between" in found.refusal or "off" in found.refusal
    # The other way the plates are in the way of each other.
    other = "inside" if side == "outside" else "outside"
    cells, rows = round_an_edge(other, turn)
    assert not replay_over_surface(gantry(), cells, task, rows, np.zeros(12, dtype=bool)).accepted


@pytest.mark.parametrize(("cone_deg", "off", "good"), [
    (20, 0.0, True), (13, 0.0, True), (10, 0.0, False), (20, 0.25e-3, True), (20, 1.1e-3, False),
])  # fmt: skip
def test_at_an_inner_crease_the_tool_changes_plates_where_it_is_over_both(cone_deg, off, good):
    """Where the parallels of both meet, by half of the turn from either normal."""
    turn, h = 0.4, 0.02
    plates = [plane((0.0, 0.1), (-0.1, 0.1))]
    plates += [plane((-0.1, 0.0), (-0.1, 0.1), rpy_deg=(0, np.degrees(turn), 0))]
    cells = piecewise(plates, side="outside", position=(0.45, 0.0, 0.3)).cells((2, 3))
    angles = np.concatenate([np.zeros(30), np.linspace(0.0, turn, 31), np.full(30, turn)])
    up = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=-1)
    meeting = (h / np.cos(turn / 2) + off) * np.array([np.sin(turn / 2), 0, np.cos(turn / 2)])
    along = np.linspace(0.06, 0.0, 30, endpoint=False)[:, None]
    ways = np.array([1.0, 0.0, 0.0]), -np.array([np.cos(turn), 0.0, -np.sin(turn)])
    points = np.concatenate(
        [meeting + along * ways[0], np.tile(meeting, (31, 1)), meeting + along[::-1] * ways[1]]
    )
    rows = configurations(cells.surface.position + points, -up)
    task, none = Task(standoff=h, cone_deg=cone_deg, tolerance=1e-3), np.zeros(12, dtype=bool)
    assert replay_over_surface(gantry(), cells, task, rows, none).accepted == good


@pytest.mark.parametrize(("polar", "azimuth"), [
    (np.linspace(0.8, -0.8, 400), 0.7), (np.linspace(0.8, -0.8, 401), -2.0),
    (0.5, np.linspace(0.3, 7.3, 900)),
])  # fmt: skip
def test_over_a_pole_and_around_a_closed_surface(polar, azimuth):
    """Straight over the pole of a ball, also with a row on it, and once around it and on."""
    made = raster("ball")
    polar, azimuth = np.broadcast_arrays(polar, azimuth)
    s = np.sin(polar)
    normal = np.stack([s * np.cos(azimuth), s * np.sin(azimuth), np.cos(polar)], -1)
    rows = configurations(made.cells.surface.position + 0.13 * normal, -normal)
    outcome = replay_over_surface(*made[:3], rows, np.zeros(len(made.cells), dtype=bool))
    assert outcome.accepted, outcome.refusal


@pytest.mark.parametrize(("by", "good"), [(0.9e-3, True), (1.1e-3, False)])
def test_beyond_the_border_the_place_stays_on_it(by, good):
    """Within the tolerance of the border's targets is on the surface; a little more is not."""
    made = raster("plane")
    surface = made.cells.surface
    low = tools_of(made.q)[0][:, 0].min() + by
    cells = replace(made.cells, surface=replace(surface, u_range=(low, surface.u_range[1])))
    none = np.zeros(len(cells), dtype=bool)
    assert replay_over_surface(made.robot, cells, made.task, made.q, none).accepted == good


def test_a_toolpath_is_run_from_its_first_pose_to_its_last():
    """Along a square and then across it: poses of other passes are nearer than both ends."""
    flat = np.array([(0.4, -0.1), (0.6, -0.1), (0.6, 0.1), (0.4, 0.1), (0.4, -0.1), (0.6, 0.1)])
    up = np.tile([0.0, 0.0, 1.0], (6, 1))
    line, task = poses(np.column_stack([flat, np.full(6, 0.2)]), up), Task(0.02, 20, 5e-4)
    q = dense(configurations(np.column_stack([flat, np.full(6, 0.22)]), -up), 9)
    marks = np.where(np.arange(len(q)) % 9 == 0, np.arange(len(q)) // 9, -1)
    assert replay_over_surface(gantry(), line, task, q, marks=marks).accepted
    back = replay_over_surface(gantry(), line, task, np.vstack([q[:6], q[3:]]))
    assert "back along the toolpath" in back.refusal
    for rows in (q[::-1], q[len(q) // 2 :]):
        assert not replay_over_surface(gantry(), line, task, rows).accepted


def test_a_toolpath_that_crosses_itself_is_followed_by_a_motion_without_marks():
    flat = np.array([(0.4, 0.0), (0.6, 0.0), (0.6, 0.1), (0.5, 0.1), (0.5, 0.0), (0.5, -0.1)])
    up = np.tile([0.0, 0.0, 1.0], (6, 1))
    line, task = poses(np.column_stack([flat, np.full(6, 0.2)]), up), Task(0.02, 20, 5e-4)
    q = dense(configurations(np.column_stack([flat, np.full(6, 0.22)]), -up), 9)
    assert not replay_over_surface(gantry(), line, task, q).accepted
    for rows, holds in ((q, True), (q[::-1], False), (np.delete(q, [26, 27, 28], axis=0), False)):
        assert verify(gantry(), line, task, rows).holds == holds


def test_bodies_that_are_too_near_are_a_fault_of_a_motion_over_a_surface():
    made = raster("plane")
    ball = Solid("link6", 6, placed(), Sphere(0.02))
    for height, accepted in ((0.5, True), (0.43, False)):
        post = Obstacle("post", Sphere(0.02), placed(0.45, 0.0, height))
        bodies = bodies_of([ball], [post], [pair("link6", "post", 0.001)])
        assert replay_over_surface(*made, bodies=bodies).accepted == accepted
