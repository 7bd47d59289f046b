"""Approaches and reference directions: at cell centres, along curves, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from coverable_arrays import unit_along
from coverable_errors import ArgumentError
from feasibility import Task
from feasibility.roll import cosine_and_sine, projected, roll_of
from feasibility.targets import check_references, target_curves
from surfaces import cylinder, plane, sphere

DOME = sphere(1.0, (10, 90), (10, 180), rpy_deg=(30, 0, 20), position=(1, 2, 3)).cells(4, 5)
PIPE = cylinder(0.2, (0, 360), (0, 1), side="outside", rpy_deg=(0, 50, 0)).cells(6, 3)
TASKS = {
    "along u": Task(0.01, 20, roll_deg=(-15, 15)),
    "along z": Task(0.01, 20, roll_deg=(-15, 15), roll_reference=(0.3, 0.2, 1)),
    "held upright": Task(0.01, 20, roll_deg=(0, 0), approach=(0.2, 0.1, -1)),
    "all fixed": Task(0.01, 20, roll_deg=(0, 5), approach=(0, 0, -2), roll_reference=(1, 2, 0)),
}


def along(first, cubics, curves, t):
    """Values, first and second derivatives by t (k, 3) of cubics at t (k,) of curves (k,)."""
    count = np.diff(first)[curves]
    piece = np.minimum((t * count).astype(int), count - 1)
    s, c = (t * count - piece)[:, None], cubics[first[curves] + piece].swapaxes(0, 1)
    values = c[0] + s * (c[1] + s * (c[2] + s * c[3]))
    slopes = (c[1] + s * (2.0 * c[2] + s * 3.0 * c[3])) * count[:, None]
    bends = (2.0 * c[2] + 6.0 * s * c[3]) * count[:, None] ** 2
    return first[curves] + piece, (values, slopes, bends)


@pytest.mark.parametrize("cells", [DOME, PIPE], ids=["dome", "pipe"])
@pytest.mark.parametrize("name", TASKS)
def test_curves_follow_the_frames_of_the_surface_within_their_bounds(name, cells):
    task, surface, rng = TASKS[name], cells.surface, np.random.default_rng(5)
    found = target_curves(cells, task)
    frames = found.frames
    curves, t = rng.integers(0, len(cells.pairs), 2000), rng.random(2000)
    piece, (value, slope, bend) = along(found.first, frames.cubics, curves, t)
    _, (b, _, _) = along(found.first, found.cubics[:, :, 3:], curves, t)

    point, _ = cells.curves.at(curves, t)
    closest = surface.closest(point)
    approach = -surface.side_sign * closest.normal
    if task.approach is not None:
        approach = np.tile(surface.rotation @ unit_along(task.approach), (len(t), 1))
    assert np.linalg.norm(b - approach, axis=1).max() <= found.deviations[:, 1].max() + 1e-12
    along_u = surface.tangent(closest.u, closest.v)
    if task.roll_reference is not None:
        along_u = np.tile(surface.rotation @ unit_along(task.roll_reference), (len(t), 1))
    right, _ = projected(along_u, approach)
    off = np.linalg.norm(value - right, axis=1)
    assert (off <= frames.deviations[curves] + 2.0 * found.deviations[curves, 1] + 1e-8).all()
    assert (np.linalg.norm(slope, axis=1) <= frames.derivative_bounds[piece, 0]).all()
    assert (np.linalg.norm(bend, axis=1) <= frames.derivative_bounds[piece, 1]).all()


@pytest.mark.parametrize("cells", [DOME, PIPE], ids=["dome", "pipe"])
@pytest.mark.parametrize("name", TASKS)
def test_frames_turn_no_faster_than_their_curvature(name, cells):
    """Beside a centre, on the target surface, in any direction."""
    task, surface, rng = TASKS[name], cells.surface, np.random.default_rng(6)
    cell, found = rng.integers(0, len(cells), 500), target_curves(cells, task)
    height = surface.side_sign * task.standoff
    x = [np.column_stack([cells.u, cells.v])[cell]]
    x.append(x[0] + 1e-4 * rng.normal(size=x[0].shape))
    points, references = [], []
    for u, v in (places.T for places in x):
        normal = surface.normal(u, v)
        b = (
            -surface.side_sign * normal
            if task.approach is None
            else surface.rotation @ unit_along(task.approach)
        )
        e = surface.tangent(u, v)
        if task.roll_reference is not None:
            e = np.tile(surface.rotation @ unit_along(task.roll_reference), (len(u), 1))
        points.append(surface.point(u, v) + height * normal)
        references.append(projected(e, b)[0])
    step, turn = (np.linalg.norm(two[1] - two[0], axis=1) for two in (points, references))
    assert (turn <= found.frames.centre_curvature * step + 1e-8).all()


def test_at_the_centres_curves_begin_with_the_targets_of_the_cells():
    for task in TASKS.values():
        targets, found = task.targets(PIPE), target_curves(PIPE, task)
        assert np.abs((targets.references * targets.approaches).sum(axis=1)).max() < 1e-12
        starts = found.frames.cubics[found.first[:-1], 0]
        assert np.allclose(starts, targets.references[PIPE.pairs[:, 0]], atol=1e-12)
    assert target_curves(PIPE, Task(0.01, 20)).frames is None
    assert Task(0.01, 20).targets(PIPE).references is None


def test_an_approach_of_its_own_leaves_the_target_on_the_normal():
    upright, usual = Task(0.01, 20, approach=(0, 0, -3)), Task(0.01, 20)
    assert np.array_equal(upright.targets(PIPE).points, usual.targets(PIPE).points)
    assert np.allclose(upright.targets(PIPE).approaches, -PIPE.surface.rotation[:, 2])
    found, other = target_curves(PIPE, upright), target_curves(PIPE, usual)
    assert np.array_equal(found.cubics[..., :3], other.cubics[..., :3])
    assert np.array_equal(found.derivative_bounds[:, 0], other.derivative_bounds[:, 0])
    assert not found.curvature.any()
    assert not found.deviations[:, 1].any()


def test_the_roll_is_that_of_the_least_rotation():
    """Swing x from a to b by Rodrigues' formula, and measure its angle from t."""
    rng = np.random.default_rng(3)
    a, b, x, t = rng.normal(size=(4, 200, 3))
    a, b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    x, t = projected(x / np.linalg.norm(x, axis=1, keepdims=True), a)[0], projected(t, b)[0]
    axis, cosine = np.cross(a, b), (a * b).sum(axis=1)[:, None]
    swung = cosine * x + np.cross(axis, x)
    swung += (axis * x).sum(axis=1)[:, None] * axis / (1.0 + cosine)
    angle = np.arctan2((np.cross(b, t) * swung).sum(axis=1), (t * swung).sum(axis=1))
    assert np.allclose(np.cos(roll_of(x, a, t, b) - angle), 1.0)
    both = np.hypot(*cosine_and_sine(x, a, t, b))
    assert np.allclose(both, 1.0 + cosine[:, 0])


def test_a_range_is_a_middle_and_a_half_width():
    assert Task(0.01, 20, roll_deg=(170, 190)).roll == pytest.approx((np.pi, np.radians(10)))
    assert Task(0.01, 120, roll_deg=(-180, 180)).roll is None
    off = Task(0.01, 20, roll_deg=(170, 190)).roll.off(np.radians([-175.0, 175.0, 0.0]))
    assert np.degrees(np.abs(off)) == pytest.approx([5, 5, 180])
    assert np.sign(off[:2]).tolist() == [1, -1]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"roll_deg": (15, -15)}, "empty"),
        ({"roll_deg": (0, 400)}, "-360 .. 360"),
        ({"roll_deg": "free"}, "roll_deg must"),
        ({"cone_deg": 95, "roll_deg": (-15, 15)}, "cone_deg must be 90 or less"),
        ({"approach": "down"}, "'normal' or a direction"),
        ({"approach": (0, 0, 0)}, "approach must be three"),
        ({"roll_reference": (1, 2)}, "roll_reference must be three"),
    ],
)
def test_a_task_that_cannot_be_is_refused(wrong, said):
    with pytest.raises(ArgumentError, match=said):
        Task(**{"standoff": 0.01, "cone_deg": 20.0, **wrong})


def test_a_reference_along_the_approach_is_refused_with_its_cells():
    cells = plane((0, 1), (0, 1)).cells(2, 2)
    upright = Task(0.1, 20, roll_deg=(-1, 1), roll_reference=(0, 0.01, 1))
    with pytest.raises(ArgumentError, match=r"at cells \[0, 0\], \[0, 1\], \[1, 0\] and 1 more"):
        check_references(cells, upright)
    check_references(cells, Task(0.1, 20, roll_reference=(0, 0, 1)))
