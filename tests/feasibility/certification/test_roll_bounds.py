"""Bounds on the roll hold where they are sampled, and less would be wrong."""

from __future__ import annotations

import numpy as np
import pytest
from arm_urdfs import joint
from random_arms import random_arm, robot_of

from feasibility import Task
from feasibility.certification.jacobians import placements
from feasibility.certification.rolls import Held, ToolAxes, reference_axes, tool_frames
from feasibility.certification.rolls.bounds import (
    largest_off,
    off_middle,
    products_of_changes,
    vectors_of,
)
from feasibility.roll import Roll
from surfaces import cylinder, sphere
from surfaces.places import Places, offset_surface

S = np.linspace(0.0, 1.0, 101)[:, None]


def lines(rng, count, size):
    """(4, 2, k, 3) ends of straight lines of x, y, t and u, no unit vectors between the ends."""
    start = np.linalg.qr(rng.normal(size=(4, count, 3, 3)))[0][:, :, 0]
    found = np.stack([start, start + size * rng.normal(size=start.shape)])
    return found.transpose(1, 0, 2, 3)


@pytest.mark.parametrize("half", [0.4, 1.2, np.pi / 2, 2.5])
@pytest.mark.parametrize("middle", [0.0, 2.0])
def test_a_range_holds_the_roll_all_along_and_hardly_less_would(half, middle):
    rng, roll, used = np.random.default_rng(3), Roll(middle, half), []
    for size in (0.03, 0.3, 1.0):
        x, y, t, u = lines(rng, 500, size)
        z0, z1 = (vectors_of(x[k], y[k], t[k], u[k], roll) for k in (0, 1))
        second = products_of_changes(*(one[1] - one[0] for one in (x, y, t, u)))
        unknown = size * rng.random((len(z0), 2)) * rng.integers(0, 2, (1, 2))
        found = largest_off(z0, z1, second, unknown, half)
        at = ((1.0 - S[..., None]) * one[0] + S[..., None] * one[1] for one in (x, y, t, u))
        z = vectors_of(*at, roll)
        # What is not known of both ends may point anywhere.
        for angle in np.linspace(-np.pi, np.pi, 7):
            way = np.array([np.cos(angle), np.sin(angle)])
            less = (1.0 - S) * unknown[:, 0] + S * unknown[:, 1]
            truth = off_middle(z + less[..., None] * way).max(axis=0)
            some = np.isfinite(found)
            assert (truth[some] <= found[some] + 1e-6).all()
            used.append((truth / found)[some & (truth > 0.05)].max(initial=0.0))
    assert max(used) > 0.97


@pytest.mark.parametrize("seed", range(10))
def test_frames_of_the_tool_bend_no_more_than_is_said(seed):
    rng = np.random.default_rng(seed)
    alone = robot_of([joint(1), joint(2, "fixed", (0.5, 0, 0))])  # both of its axes turn about z
    robot = random_arm(rng) if seed else alone
    ends = rng.uniform(-1.0, 1.0, (2, robot.n))
    steps = np.abs(np.diff(ends, axis=0))
    axes, x = placements(robot, ends).axes, reference_axes(robot, ends)
    bound = tool_frames(robot, ends, axes, x).second_derivatives(robot, steps)[0]
    q = ends[0] + S * (ends[1] - ends[0])
    x, axes = reference_axes(robot, q), placements(robot, q).axes
    bent = [np.diff(one, n=2, axis=0) * 100.0**2 for one in (x, np.cross(axes, x))]
    truth = sum(np.linalg.norm(one, axis=1).max() for one in bent)
    assert truth <= bound * (1.0 + 1e-3)
    assert seed or truth > 0.99 * bound


@pytest.mark.parametrize("reference", [(1.0, 0.0, 0.0), None])
@pytest.mark.parametrize("width", [0.02, 0.2, 0.6])
def test_over_a_sphere_the_roll_of_a_tool_at_rest_or_turning_is_bounded(reference, width):
    """Places along a straight line of parameters; the reference is one direction, or u."""
    rng, count = np.random.default_rng(int(100 * width)), 400
    surface = sphere(1.0, (20, 160), (-180, 180))
    offset, used = offset_surface(surface, 0.0), []
    task = Task(0.0, 90, roll_deg=(-80.0, 80.0), roll_reference=reference)
    held = Held.of(task, surface.cells(2, 2), offset)
    first = np.stack([rng.uniform(0.9, 2.2, count), rng.uniform(-2.0, 2.0, count)], axis=1)
    last = first + width * rng.uniform(-1.0, 1.0, (count, 2))
    chart = np.zeros(count, dtype=np.int64)
    path = offset.paths(Places(chart, first), Places(chart, last))
    approaches = held.approaches(path.normals)
    turn = 0.5 * width * rng.uniform(-1.0, 1.0, count) * rng.integers(0, 2, count)
    begin = rng.uniform(-1.3, 1.3, count)

    def frame(angle):
        """A tool that turns about the approach at the start of each path."""
        b = approaches[:, 0]
        t = held._references(path.place(0), b)[0]
        return np.cos(angle)[:, None] * t + np.sin(angle)[:, None] * np.cross(b, t), b

    (x0, axes), (x1, _) = frame(begin), frame(begin + turn)
    found = held.rolls_between(
        ToolAxes(axes, x0), ToolAxes(axes, x1), 2.0 * turn**2, path, approaches
    )
    truth = np.zeros(count)
    for s in S[::2, 0]:
        places = Places(chart, first + s * (last - first))
        x, b = frame(begin + s * turn)[0], held.approaches(offset.at(places)[1])
        truth = np.maximum(truth, held.rolls(x, axes, b, places))
    some = np.isfinite(found)
    assert (truth[some] <= found[some] + 1e-6).all()
    used = (truth[some] / found[some]).max()
    assert some.sum() > 50
    assert used > 0.9


@pytest.mark.parametrize("kind", ["dome", "tube", "by u"])
def test_references_bend_no_more_than_is_said(kind):
    """Past where the approach is nearly along the reference, t turns fast."""
    rng, count = np.random.default_rng(5), 600
    dome = sphere(1.0, (20, 160), (-180, 180))
    surface = dome if kind != "tube" else cylinder(1.0, (-170, 170), (-1, 1))
    offset, along = offset_surface(surface, 0.0), None if kind == "by u" else (1.0, 0.0, 0.0)
    task = Task(0.0, 90, roll_deg=(-80.0, 80.0), roll_reference=along)
    held = Held.of(task, surface.cells(2, 2), offset)
    middle = [np.pi / 2, 0.0] if kind != "tube" else [0.4, 0.0]
    way = 10.0 ** rng.uniform(-3, -1.3, (count, 1)) * rng.normal(size=(count, 2))
    beside = np.linalg.norm(way, axis=1, keepdims=True) * rng.uniform(0.7, 3.0, (count, 1))
    first = middle + beside * rng.choice([-1.0, 1.0], (count, 2)) - 0.5 * way
    chart = np.zeros(count, dtype=np.int64)
    path = offset.paths(Places(chart, first), Places(chart, first + way))
    found = held.references_along(path, held.approaches(path.normals))
    some = np.isfinite(found.second_u[:, 2]) & (path.share[:, 2] == 0.0)
    assert some.sum() > 100
    used = []
    for s in (0.1, 0.3, 0.5, 0.8):
        places = Places(chart, first + s * way)
        b = held.approaches(offset.at(places)[1])
        t = held.references_along(offset.paths(places, places), np.stack([b] * 4, axis=1)).t[:, 0]
        ends = found.t[:, 0], found.t[:, 3]
        normals = [held.approaches(path.normals[:, k]) for k in (0, 3)]
        pairs = [np.cross(one, other) for one, other in zip(normals, ends, strict=True)]
        for here, (one, other), second in (
            (t, ends, found.second_t), (np.cross(b, t), pairs, found.second_u),
        ):  # fmt: skip
            off = np.linalg.norm(here - (1.0 - s) * one - s * other, axis=1)[some]
            most = 0.5 * s * (1.0 - s) * second[some, 2]
            assert (off <= most + 1e-7).all()
            used.append((off / most)[off > 1e-4].max(initial=0.0))
    assert kind != "dome" or min(used) > 0.6
