"""Models of the roll over boxes, which proofs rest on: samples, and a second reading of them."""

import numpy as np
import pytest
from referee import unit

from coverable import Task, load_robot, sphere
from feasibility.certification import roll_box_models
from feasibility.certification.cut_proofs import linear_models
from feasibility.certification.cut_proofs.linear_models import Allowed, models_of, target_parts
from feasibility.certification.roll_box_models import Directions, reference_parts, roll_models
from feasibility.roll import Roll, projected
from robots.kinematics import Kinematics

UR5 = load_robot("ur5")


def tool_model(q, half):
    """x and y about q (n,) over a box of half widths (n,), and what boxes are made of by hand."""
    _, axis = Kinematics(UR5).tool(q)
    x = Kinematics(UR5).held(q[None])[2]
    both = np.stack([x, np.cross(axis, x)], axis=1)
    turning = Kinematics(UR5).twists(q[None]).transpose(0, 2, 1)[..., 3:]
    second = half @ (half + 2.0 * (np.cumsum(half) - half))
    many = np.full((1, 2), second), np.full((1, 2), min(half.sum(), 2.0))
    return roll_box_models.ToolModel(both, np.cross(turning[:, :, None], both[:, None]), *many)


def test_models_of_the_roll_hold_over_their_boxes():
    rng, kinematics = np.random.default_rng(2), Kinematics(UR5)
    for _ in range(60):
        roll = Roll(rng.uniform(-3, 3), np.exp(rng.uniform(np.log(0.01), np.log(np.pi / 2))))
        r, b = unit(rng.normal(size=3)), unit(rng.normal(size=3))
        half = np.exp(rng.uniform(np.log(1e-3), np.log(0.2), UR5.n))
        slopes = 0.05 * rng.normal(size=(1, 2, 3))
        # The model of b, not made a unit vector, is off one by this at most.
        radius = np.array([np.linalg.norm(slopes, axis=2).sum() ** 2])
        model = Directions(b[None], slopes, radius)
        held = reference_parts(model, Directions.fixed(r, 1))
        q = rng.uniform(-2, 2, UR5.n)
        found = roll_models(tool_model(q, half), model, held, np.ones((1, 2)), roll)
        inner, x = rng.uniform(-1, 1, (200, UR5.n)) * half, rng.uniform(-1, 1, (200, 2))
        near = unit(b + np.einsum("ki,id->kd", x, slopes[0]))
        t, _ = projected(np.tile(r, (200, 1)), near)
        _, axes, own = kinematics.held(q + inner)
        y, u = np.cross(axes, own), np.cross(near, t)
        cosine, sine = (t * own + u * y).sum(axis=1), (u * own - t * y).sum(axis=1)
        for end, sign in enumerate((1.0, -1.0)):
            angle = roll.middle + sign * roll.half
            true = sign * (np.sin(angle) * cosine - np.cos(angle) * sine) - 1.0
            made = np.concatenate([inner, x], axis=1) @ found.columns[0, :, end]
            off = np.abs(found.residual[0, end] + made - true)
            assert off.max() <= found.radius[0, end] - 1.0 + 1e-12 or found.radius[0, end] == 4.0


def test_all_joints_together_turn_the_reference_axis():
    """What each joint alone adds to the radii, all together add at least."""
    dome = sphere(0.3, (0, 25), (0, 360), side="outside")
    task = Task(0.02, 20, roll_deg=(-30, 30), roll_reference=(1, 0, 0))
    parts = target_parts(dome.parts(0.01, 0.05), dome.cells(1, 1), task)
    q = np.append(np.full(6, 0.5), [0.0, 0.0])
    part = int(np.argmin(parts.radius[:, 1]))

    def radii(joints):
        half = np.append(1e-4 * joints, [1.0, 1.0])
        box = linear_models.Boxes((q - half)[None], (q + half)[None], *np.array([[part], [0]]))
        return models_of(Kinematics(UR5), box, parts, Allowed(1e-3, 0.3, 1.0, task.roll)).radius[
            0, 2:
        ]

    none = radii(np.zeros(6))
    alone = sum(radii(one) - none for one in np.eye(6))
    assert (alone > 1e-6).all()
    assert (radii(np.ones(6)) - none >= 0.999 * alone).all()


def lengths(vectors):
    return sum(float(np.linalg.norm(vector)) for vector in vectors)


def test_radii_are_those_of_the_lemma():
    """A second reading of `rolls.box_models`, term by term: also of terms that others outweigh."""
    rng, root = np.random.default_rng(7), np.sqrt(3.0)
    for number in range(10):
        r, b = unit(rng.normal(size=3)), 1.02 * unit(rng.normal(size=3))
        slopes, r_b = 0.02 * rng.normal(size=(2, 3)), rng.uniform(1e-3, 1e-2)
        e = r + 0.02 * (number % 2) * rng.normal(size=3)
        de, r_e = (number % 2) * 0.02 * rng.normal(size=(2, 3)), (number % 2) * 0.01
        model = Directions(b[None], slopes[None], np.array([r_b]))
        held = reference_parts(model, Directions(e[None], de[None], np.array([r_e])))
        shortest = np.linalg.norm(b) - lengths(slopes) - r_b
        beta, off = lengths(slopes) / shortest, r_b / shortest
        own, most = lengths(de), max(np.linalg.norm(e), 1.0) + lengths(de) + r_e
        h = np.linalg.norm(np.cross(e, unit(b))) - most * (beta + off) - own - r_e
        if h < 0.1:
            continue
        curved = most * (2.0 * 2.0 / root * beta**2 + 2.0 * beta**2) + 4.0 * own * beta
        bent = curved / h + 2.0 / root * ((most * beta + own) / h) ** 2
        assert held.radius[0] == pytest.approx(0.5 * bent + (most * off + r_e) / h)

        t, k, r_t = held.centre[0], held.slopes[0], float(held.radius[0])
        half = rng.uniform(0.2, 1.0, 2)
        x = unit(rng.normal(size=3))
        y, columns = unit(np.cross(x, rng.normal(size=3))), 0.3 * rng.normal(size=(1, 6, 2, 3))
        second, moves = rng.uniform(0.0, 0.1, (2, 1, 2))
        tool = roll_box_models.ToolModel(np.stack([x, y])[None], columns, second, moves)
        roll = Roll(rng.uniform(-3, 3), rng.uniform(0.1, 1.5))
        found = roll_models(tool, model, held, half[None], roll)
        spans = [lengths(half[:, None] * one) for one in (slopes, k)]
        size_b, size_t = (float(np.linalg.norm(one)) for one in (b, t))
        r_u = (
            (size_b + spans[0]) * r_t + (size_t + spans[1]) * r_b + r_b * r_t + spans[0] * spans[1]
        )
        u = np.cross(b, t)
        du = [np.cross(slopes[i], t) + np.cross(b, k[i]) for i in (0, 1)]
        for end, sign in enumerate((1.0, -1.0)):
            c, s = (sign * f(roll.middle + sign * roll.half) for f in (np.cos, np.sin))
            p, q = s * t - c * u, c * t + s * u
            moved = [
                lengths(half[i] * (one * k[i] + other * du[i]) for i in (0, 1))
                for one, other in ((s, -c), (c, s))
            ]
            radius = 1.0 + (abs(s) + abs(c)) * (r_t + r_u)
            for one, v in enumerate((p, q)):
                radius += 0.5 * second[0, one] * np.linalg.norm(v) + moves[0, one] * moved[one]
            assert found.radius[0, end] == pytest.approx(min(radius, 4.0), abs=1e-7)
            assert found.residual[0, end] == pytest.approx(x @ p + y @ q - 1.0)
