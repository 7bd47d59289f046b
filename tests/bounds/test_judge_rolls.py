"""The judge of the roll: its bounds hold where they are sampled, and both judges obey them."""

from dataclasses import replace

import numpy as np
import pytest
from arm_urdfs import joint
from gantry import SURFACES, raster, references_of, tools_of
from random_arms import random_arm, robot_of
from referee import roll_about, unit
from samples import sampled, seeds

from coverable import cylinder, replay, sphere
from feasibility.certification import roll_held
from feasibility.certification.lever_bounds import jacobians
from feasibility.certification.motion_replay import replay_over_surface
from feasibility.certification.roll_box_models import Directions, reference_parts
from feasibility.roll import Roll
from feasibility.targets.references import u_directions
from feasibility.verdict import Walk
from robots.kinematics import Kinematics
from surfaces.places.offset_surfaces import offset_surface
from surfaces.places.places import PlacePaths, Places

S = np.linspace(0.0, 1.0, 101)[:, None]
X, Y, Z = np.eye(3)


def lines(rng, count, size):
    """(4, 2, k, 3) ends of straight lines of x, y, t and u, no unit vectors between the ends."""
    start = np.linalg.qr(rng.normal(size=(4, count, 3, 3)))[0][:, :, 0]
    return np.stack([start, start + size * rng.normal(size=start.shape)]).transpose(1, 0, 2, 3)


@pytest.mark.parametrize("half", [0.4, np.pi / 2, 2.5])
@pytest.mark.parametrize("middle", [0.0, 2.0])
def test_a_range_holds_the_roll_all_along_and_hardly_less_would(half, middle):
    rng, roll, used = np.random.default_rng(3), Roll(middle, half), []
    for size in (0.03, 0.3, 1.0):
        x, y, t, u = lines(rng, 300, size)
        z0, z1 = (roll_held.vectors_of(x[k], y[k], t[k], u[k], roll) for k in (0, 1))
        second = roll_held.products_of_changes(*(one[1] - one[0] for one in (x, y, t, u)))
        unknown = size * rng.random((len(z0), 2)) * rng.integers(0, 2, (1, 2))
        found = roll_held.largest_off(z0, z1, second, unknown, half)
        at = ((1.0 - S[..., None]) * one[0] + S[..., None] * one[1] for one in (x, y, t, u))
        z = roll_held.vectors_of(*at, roll)
        # What is not known of both ends may point anywhere.
        for angle in np.linspace(-np.pi, np.pi, 7):
            way = np.array([np.cos(angle), np.sin(angle)])
            less = (1.0 - S) * unknown[:, 0] + S * unknown[:, 1]
            truth = roll_held.off_middle(z + less[..., None] * way).max(axis=0)
            some = np.isfinite(found)
            assert (truth[some] <= found[some] + 1e-6).all()
            used.append((truth / found)[some & (truth > 0.05)].max(initial=0.0))
    assert max(used) > 0.97


def test_wide_ranges_are_certified_from_end_to_end():
    """A slow turn from one end of a range of 300 degrees to the other, in parts."""
    angle = np.radians(np.linspace(-149, 149, 60))
    z, none = 2.0 * np.column_stack([np.cos(angle), np.sin(angle)]), np.zeros((59, 2))
    bend = 2.0 * np.diff(angle) ** 2
    bound = roll_held.largest_off(z[:-1], z[1:], bend, none, np.radians(150))
    assert np.isfinite(bound).all()
    assert (bound >= np.maximum(np.abs(angle[1:]), np.abs(angle[:-1])) - 1e-9).all()
    across = 2.0 * np.array([[-1.0, 0.1], [-1.0, -0.1]])
    assert not np.isfinite(roll_held.largest_off(across[:1], across[1:], bend[:1], none[:1], 3.0))


@sampled("seed", seeds(6, all=60))
def test_frames_of_the_tool_bend_no_more_than_is_said(seed):
    rng = np.random.default_rng(seed)
    alone = robot_of([joint(1), joint(2, "fixed", (0.5, 0, 0))])  # both of its axes turn about z
    robot = random_arm(rng) if seed else alone
    ends = rng.uniform(-1.0, 1.0, (2, robot.n))
    steps, poses = np.abs(np.diff(ends, axis=0)), jacobians(Kinematics(robot), ends)
    x = Kinematics(robot).held(ends)[2]
    bound = roll_held.frame_second_derivatives(steps, robot.prismatic, poses, x)[0]
    q = ends[0] + S * (ends[1] - ends[0])
    _, axes, x = Kinematics(robot).held(q)
    bent = [np.diff(one, n=2, axis=0) * 100.0**2 for one in (x, np.cross(axes, x))]
    truth = sum(np.linalg.norm(one, axis=1).max() for one in bent)
    assert truth <= bound * (1.0 + 1e-3)
    assert seed or truth > 0.99 * bound


@pytest.mark.parametrize("kind", ["dome", "tube", "by u"])
def test_references_bend_no_more_than_is_said(kind):
    """Past where the approach is nearly along the reference, t turns fast."""
    rng, count = np.random.default_rng(5), 400
    surface = cylinder(1.0, (-170, 170), (-1, 1)) if kind == "tube" else None
    surface = surface or sphere(1.0, (20, 160), (-180, 180))
    offset = offset_surface(surface, 0.0, directed=True)
    held = roll_held.HeldRoll(Roll(0.0, 1.4), False)
    middle = [np.pi / 2, 0.0] if kind != "tube" else [0.4, 0.0]
    way = 10.0 ** rng.uniform(-3, -1.3, (count, 1)) * rng.normal(size=(count, 2))
    beside = np.linalg.norm(way, axis=1, keepdims=True) * rng.uniform(0.7, 3.0, (count, 1))
    first = middle + beside * rng.choice([-1.0, 1.0], (count, 2)) - 0.5 * way
    chart = np.zeros(count, dtype=np.int64)

    def paths(*ends):  # approaches against normals, and one reference or u directions
        path = offset.paths(*(Places(chart, x) for x in ends))
        if kind != "by u":
            path.tangents[:], path.deviations[..., 2] = X, 0.0
        return replace(path, normals=-path.normals)

    path = paths(first, first + way)
    found = held.references_along(path)
    some = np.isfinite(found.beside[:, 2])
    assert some.sum() > 80
    ends = [(path.normals[:, k], found.t[:, k]) for k in (0, 3)]
    used = []
    for s in (0.1, 0.5, 0.8):
        here = paths(first + s * way, first + s * way)
        b, t = here.normals[:, 0], held.references_along(here).t[:, 0]
        off = 0.0
        for here, (one, other) in (
            (t, [t for _, t in ends]), (np.cross(b, t), [np.cross(b, t) for b, t in ends]),
        ):  # fmt: skip
            off = off + np.linalg.norm(here - (1.0 - s) * one - s * other, axis=1)[some]
        most = (0.5 * s * (1.0 - s) * found.second_u + found.beside)[some, 2]
        assert (off <= most + 1e-7).all()
        used.append((off / most)[off > 1e-4].max(initial=0.0))
    assert kind != "dome" or max(used) > 0.3


@pytest.mark.parametrize("kind", ["fixed", "u", "square"])
def test_the_bounds_of_references_are_those_of_the_lemma(kind):
    """A second reading of `rolls.held`, term by term: also of terms that others outweigh."""
    rng, half = np.random.default_rng(8), np.radians(85.0)
    for _ in range(12):
        b = unit(-Z + 0.1 * rng.normal(size=(4, 3)))
        e = np.tile(X, (4, 1)) if kind == "fixed" else unit(X + 0.1 * rng.normal(size=(4, 3)))
        b[2], e[2] = b[1], e[1]
        aside, own = rng.uniform(0.001, 0.02, (2, 3))
        own *= kind != "fixed"
        roll = Roll(0.1, half)
        held = roll_held.HeldRoll(roll, kind == "square")
        at, none = np.array([0.0, 0.4, 0.4, 1.0]), np.zeros((1, 4, 3))
        off = np.stack([0.0 * aside, aside, own], axis=1)[None]
        path = PlacePaths(at[None], none, b[None], e[None], off, none[..., 0], none[..., :2])
        t = unit(e - (e * b).sum(axis=1, keepdims=True) * b)
        u = np.cross(b, t)
        x, axes = unit(X + 0.1 * rng.normal(size=(2, 3))), unit(-Z + 0.1 * rng.normal(size=(2, 3)))
        y, second, worst = np.cross(axes, x), rng.uniform(0.01, 0.05), []
        known = held.references_along(path)
        for k in (0, 2):
            d_b = aside[k]
            directions = Directions.between(b[k : k + 1], b[k + 1 : k + 2], np.array([d_b]))
            reference = Directions.between(e[k : k + 1], e[k + 1 : k + 2], 0.5 * own[k : k + 1])
            d_t = 2.0 * reference_parts(directions, reference, kind == "square").radius[0]
            of_u = 2.0 * np.linalg.norm(b[k + 1] - b[k]) * np.linalg.norm(t[k + 1] - t[k])
            assert d_t == pytest.approx(own[k]) or kind != "square"
            assert known.beside[0, k] == pytest.approx(2.0 * d_t + d_b)
            assert known.second_u[0, k] == pytest.approx(of_u)
            one, other = ([(1.0 - s) * v[0] + s * v[1] for v in (x, y)] for s in at[k : k + 2])
            ends = (*one, t[k], u[k]), (*other, t[k + 1], u[k + 1])
            dx, dy, dt, du = (last - first for first, last in zip(*ends, strict=True))
            most = 2.0 * np.hypot(dt @ dx + du @ dy, du @ dx - dt @ dy)
            most += (at[k + 1] - at[k]) ** 2 * second + np.sqrt(2.0) * of_u
            z0 = roll_held.vectors_of(*one, t[k], u[k], roll)[None]
            z1 = roll_held.vectors_of(*other, t[k + 1], u[k + 1], roll)[None]
            unknown = np.array([[s * (1.0 - s) / 2.0 * second for s in at[k : k + 2]]])
            unknown += np.sqrt(2.0) * (2.0 * d_t + d_b)
            worst.append(roll_held.largest_off(z0, z1, np.array([most]), unknown, half)[0])
        ends = [tuple(np.split(one, 2)) for one in (x, axes)]
        found = held.rolls_between(*ends, np.array([second]), path)
        assert found[0] == pytest.approx(max(worst), abs=1e-7)


REFERENCES = {
    "plane": None, "ball": (0.2, 1.0, 0.0), "pipe": None, "ring": None, "spline": None,
    "mesh": (1.0, 0.3, 0.1), "sheets": (1.0, 0.0, 0.0),
}  # fmt: skip
BESIDE = 0.5  # deg


def rolls(cells, q, reference):
    points, axes = tools_of(q)
    found = cells.surface.closest(points)
    b = -cells.surface.side_sign * found.normal
    e = u_directions(cells.surface, points - found.height[:, None] * found.normal)
    if reference is not None:
        e = np.tile(cells.surface.rotation @ unit(np.array(reference)), (len(b), 1))
    return roll_about(references_of(q), axes, e, b)


def limited(name, low=-BESIDE, high=BESIDE):
    """A raster, with a task whose range is that of dense samples and a little more or less."""
    made, reference = raster(name), REFERENCES[name]
    found = np.unwrap(rolls(made.cells, made.q, reference))
    middle = rolls(made.cells, 0.5 * (made.q[1:] + made.q[:-1]), reference)
    aside = (middle - found[:-1] + np.pi) % (2 * np.pi) - np.pi
    seen = np.degrees(np.concatenate([found, found[:-1] + aside]))
    turn = 360.0 * np.round(seen.mean() / 360.0)
    most = seen.min() - turn + low, seen.max() - turn + high
    return made._replace(task=replace(made.task, roll_deg=most, roll_reference=reference))


@pytest.mark.parametrize("name", SURFACES)
def test_motions_within_the_range_are_accepted_and_beyond_one_end_refused_there(name):
    made = limited(name)
    found = replay_over_surface(*made)
    assert found.accepted, found.refusal
    off = np.abs(made.task.roll.off(rolls(made.cells, made.q, REFERENCES[name])))
    assert off.max() - 1e-6 <= found.certificate.max_roll <= made.task.roll.half + 1e-9
    for ends in ((-BESIDE, -BESIDE), (BESIDE, BESIDE)):
        made = limited(name, *ends)
        found = replay_over_surface(*made)
        (fault,) = (fault for fault in found.faults if "the roll is" in str(fault))
        off = np.abs(made.task.roll.off(rolls(made.cells, made.q, REFERENCES[name])))
        assert off[fault.row] == pytest.approx(off.max(), abs=1e-6)
        assert 0.49 < float(fault.text.split()[3]) < 0.51


@pytest.mark.parametrize("name", ["plane", "pipe", "mesh"])
@pytest.mark.parametrize("turn", [2 * np.pi, -2 * np.pi])
def test_a_turn_of_the_tool_between_two_rows_is_seen(name, turn):
    """Every row is right; only between them the roll is not."""
    made, k = limited(name), 40
    q = made.q.copy()
    q[k:, 5] += turn
    found = replay_over_surface(made.robot, made.cells, made.task, q)
    assert [fault.row for fault in found.faults] == [k - 1]
    assert "the roll is" in found.refusal


@pytest.mark.parametrize("long_way", [False, True])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_long_way_round_is_refused(sign, long_way):
    made = raster("plane")
    roll = np.degrees(rolls(made.cells, made.q[:1], None)[0])
    task = replace(made.task, roll_deg=(roll - 20.0, roll + 20.0))
    rows = np.repeat(made.q[:1], 2, axis=0)
    rows[:, 5] += sign * np.radians([-19.0, 19.0 - 360.0 * long_way])
    none = np.zeros(len(made.cells), dtype=bool)
    walk = Walk(rows, np.array([0, 0]))
    for found in (
        replay(made.robot, made.cells, task, walk, none),
        replay_over_surface(made.robot, made.cells, task, rows, none),
    ):
        assert found.accepted is not long_way
        if found.accepted:
            assert np.radians(19.0) - 1e-6 <= found.certificate.max_roll <= task.roll.half


def test_without_limits_nothing_is_said_of_the_roll():
    made = raster("plane")
    assert replay_over_surface(*made).certificate.max_roll is None
    free = made._replace(task=replace(made.task, roll_deg=(-180, 180)))
    assert replay_over_surface(*free).accepted
    held = replace(made.task, approach=(0, 0, -1))
    assert replay_over_surface(made.robot, made.cells, held, made.q).accepted
    held = replace(held, approach=(0, 1, -1))
    assert "tool axis tilts 45" in replay_over_surface(made.robot, made.cells, held, made.q).refusal
