"""Proofs that rest on the roll: confirmed where it is limited, refuted where it is free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from feasibility import Task
from feasibility.certification import verify_proof
from feasibility.certification.rolls import reference_axes
from feasibility.certification.rolls.box_models import (
    TargetModel,
    ToolModel,
    reference_parts,
    roll_models,
)
from feasibility.cut_tree import CutTree, Leaf
from feasibility.roll import Roll, projected
from robots import Kinematics, load_robot
from surfaces import plane

ARM = load_robot("ur5")
TABLE = plane((0.35, 0.55), (-0.1, 0.1), side="outside", position=(0, 0, 0.2)).cells(1, 1)
DOWN = Task(0.005, 2.0, roll_deg=(-2, 2), roll_reference=(1, 0, 0))
EVERYWHERE = CutTree(Leaf(0))
LIMITS = {
    "wrist_3_joint": np.radians([20.0, 60.0]),
    "shoulder_pan_joint": (-1.5, 1.5),
    "shoulder_lift_joint": (-2.5, -0.5),
    "elbow_joint": (0.5, 2.5),
}


def test_a_cell_that_the_roll_alone_prevents_is_proved():
    """With the last joint held, the tool comes to the table, but never along x."""
    found = verify_proof(ARM.with_limits(LIMITS), TABLE, DOWN, EVERYWHERE, most=200_000)
    assert found.accepted, found.refusal


@pytest.mark.parametrize("change", [{"roll_deg": None}, {"roll_deg": (-180, 60)}])
def test_the_same_is_wrong_where_the_roll_may_be_another(change):
    task = replace(DOWN, **change)
    found = verify_proof(ARM.with_limits(LIMITS), TABLE, task, EVERYWHERE, most=200_000)
    assert "is wrong: the tool can be at its target" in found.refusal


def test_models_of_the_roll_hold_over_their_boxes():
    rng, kinematics = np.random.default_rng(2), Kinematics(ARM)
    for _ in range(60):
        roll = Roll(rng.uniform(-3, 3), np.exp(rng.uniform(np.log(0.01), np.log(np.pi / 2))))
        r, half = rng.normal(size=3), np.exp(rng.uniform(np.log(1e-3), np.log(0.2), ARM.n))
        r /= np.linalg.norm(r)
        b = rng.normal(size=3)
        b /= np.linalg.norm(b)
        slopes = 0.05 * rng.normal(size=(1, 2, 3))
        # The model of b, not made a unit vector, is off one by this at most.
        radius = np.array([np.linalg.norm(slopes, axis=2).sum() ** 2])
        held = reference_parts(b[None], slopes, radius, r)
        q = rng.uniform(-2, 2, ARM.n)
        target = TargetModel(
            np.stack([b, held.centre[0]])[None],
            np.stack([slopes, held.slopes], axis=2),
            np.ones((1, 2)),
            np.array([[radius[0], held.radius[0]]]),
        )
        found = roll_models(_tool(q, half), target, roll)
        inner, x = rng.uniform(-1, 1, (200, ARM.n)) * half, rng.uniform(-1, 1, (200, 2))
        near = b + np.einsum("ki,id->kd", x, slopes[0])
        near /= np.linalg.norm(near, axis=1, keepdims=True)
        t, _ = projected(np.tile(r, (200, 1)), near)
        _, axes = kinematics.tools(q + inner)
        own = reference_axes(ARM, q + inner)
        y, u = np.cross(axes, own), np.cross(near, t)
        cosine = (t * own + u * y).sum(axis=1)
        sine = (u * own - t * y).sum(axis=1)
        for end, sign in enumerate((1.0, -1.0)):
            angle = roll.middle + sign * roll.half
            true = sign * (np.sin(angle) * cosine - np.cos(angle) * sine) - 1.0
            line = np.concatenate([inner, x], axis=1) @ found.columns[0, :, end]
            off = np.abs(found.residual[0, end] + line - true)
            assert off.max() <= found.radius[0, end] - 1.0 + 1e-12 or found.radius[0, end] == 4.0


def _tool(q, half):
    """The model of x and y about q (n,), over a box of half widths (n,)."""
    from feasibility.certification.lever_bounds import lever_bounds

    _, axis = Kinematics(ARM).tool(q)
    x = reference_axes(ARM, q[None])
    both = np.stack([x, np.cross(axis, x)], axis=1)
    turning = Kinematics(ARM).twists(q[None]).transpose(0, 2, 1)[..., 3:]
    columns = np.cross(turning[:, :, None], both[:, None])
    bounds = [
        lever_bounds(
            np.linalg.norm(columns[:, :, k], axis=2), half[None], ARM.prismatic, np.ones(6)
        )
        for k in (0, 1)
    ]
    return ToolModel(
        both,
        columns,
        np.column_stack([bound.second for bound in bounds]),
        np.column_stack([np.minimum((b.largest * half).sum(axis=1), 2.0) for b in bounds]),
    )
