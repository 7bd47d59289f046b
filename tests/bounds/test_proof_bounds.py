"""The verifier's bounds: no box around a known place is lost, and no remainder is too small."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from bounds import holds
from part_walks import at_parameters
from random_arms import random_arm, tilted
from random_surfaces import KINDS, random_surface
from referee import unit
from samples import sampled, seeds
from scipy.spatial.transform import Rotation
from specimens import cells_of

from coverable import Task, cone, cylinder, hyperboloid, load_robot, plane, sphere, torus
from feasibility.certification.collisions.everywhere import Deepest
from feasibility.certification.cut_proofs import linear_models, parts_agreement
from feasibility.certification.cut_proofs.box_exclusion import JointRegion, cut, smaller
from feasibility.certification.cut_proofs.empty_region import Claim, Emptiness
from feasibility.certification.cut_proofs.linear_models import Boxes, models_of, target_parts
from feasibility.certification.cut_proofs.parts_agreement import disagreement, places
from feasibility.roll import projected, roll_of
from robots.kinematics import Kinematics

OUT = {"side": "outside"}
PATCHES = (
    plane((-0.3, 0.3), (-0.2, 0.4)), sphere(0.5, (10, 170), (-160, 160), **OUT),
    sphere(1.2, (40, 100), (0, 90), side="inside"), cylinder(0.3, (-100, 100), (-0.4, 0.4), **OUT),
    hyperboloid(0.4, 0.3, (0, 200), (-0.3, 0.4), side="inside"),
    cone(0.4, 0.5, (0, 300), (-0.2, 0.3), **OUT), torus(0.5, 0.2, (0, 360), (0, 360), **OUT),
)  # fmt: skip
EXACT = 0.3  # share of deviations, tilts and box faces that are as large as they may be
X, Y, Z = np.eye(3)


class Known(NamedTuple):
    """A configuration, boxes that hold it, and how it lies in them."""

    emptiness: Emptiness
    boxes: Boxes
    places: np.ndarray  # (m, n + 2) the configuration and x in the part of each box


def up_to(rng, most):
    return most if rng.random() < EXACT else most * rng.random()


def known(rng, boxes=50):
    """A random arm at a random configuration, a patch moved to its tool, and boxes around both."""
    robot = random_arm(rng)
    robot = robot.with_limits(np.clip(np.column_stack([robot.lower, robot.upper]), -4.0, 4.0))
    q = rng.uniform(robot.lower, robot.upper)
    point, axis = Kinematics(robot).tool(q)
    tolerance, angle = np.exp(rng.uniform(np.log([1e-4, 1e-3]), np.log([0.05, 3.0])))
    patch, standoff = PATCHES[rng.integers(len(PATCHES))], rng.choice([0.0, 0.01])
    u, v = (np.array([rng.uniform(*span)]) for span in (patch.u_range, patch.v_range))
    approach = tilted(axis, up_to(rng, angle), rng)
    turn = Rotation.align_vectors(approach[None], -patch.side_sign * patch.normal(u, v))[0]
    turn = (Rotation.from_rotvec(approach * rng.uniform(-np.pi, np.pi)) * turn).as_matrix()
    patch = patch.moved(turn, np.zeros(3))
    target = point + up_to(rng, tolerance) * unit(np.cross(*rng.normal(size=(2, 3))))
    at = patch.point(u, v) + patch.side_sign * standoff * patch.normal(u, v)
    patch = patch.moved(np.eye(3), target - at[0])
    chord, task = 2.0 * np.sin(angle / 2.0), Task(standoff, 90.0)
    if angle < np.pi / 2 and rng.random() < 0.5:
        task = rolled_task(rng, robot, q, patch, (u, v), standoff)
    parts = target_parts(patch.parts(0.3 * tolerance, 0.3 * chord, 600), patch.cells(1, 1), task)
    allowed = linear_models.Allowed(tolerance, chord, 0.5, task.roll)
    emptiness = Emptiness(Kinematics(robot), parts, allowed, lambda: None)
    part, x = at_parameters(patch, u, v)
    made, within = boxes_around(rng, robot, q, parts, int(part[0]), x[0], boxes)
    return Known(emptiness, made, within)


def rolled_task(rng, robot, q, patch, place, standoff):
    """A task with a fixed reference, and a range that the roll at q is just inside of."""
    _, axis = Kinematics(robot).tool(q)
    b = -patch.side_sign * patch.normal(*place)[0]
    reference = rng.normal(size=3)
    along = patch.rotation @ unit(reference)
    roll = roll_of(Kinematics(robot).held(q[None])[2][0], axis, projected(along, b)[0], b)
    half = np.exp(rng.uniform(np.log(1e-3), np.log(np.pi / 2)))
    middle = roll + rng.choice([-1.0, 0.0, 1.0]) * 0.999 * half
    low, high = np.degrees([middle - half, middle + half])
    return Task(standoff, 90.0, roll_deg=(low, high), roll_reference=tuple(reference))


def boxes_around(rng, robot, q, parts, part, x, count):
    """Random boxes (count) that hold q and x, which belongs to `part`, and the places in them."""
    path, found = [*within(parts, part, np.append(q, x))], []
    ends = [np.append(limit, [end, end]) for limit, end in ((robot.lower, -1), (robot.upper, 1))]
    for _ in range(count):
        part, place = path[rng.integers(len(path))]
        size = np.exp(rng.uniform(np.log(1e-7), np.log(3.0))) * np.exp(rng.normal(size=len(place)))
        below, above = (up_to(rng, 1.0) * size * rng.random(len(place)) for _ in range(2))
        below[rng.random(len(place)) < 0.15] = 0.0
        above[rng.random(len(place)) < 0.15] = 0.0
        low, high = np.maximum(place - below, ends[0]), np.minimum(place + above, ends[1])
        found.append((low, high, part, place))
    low, high, which, at = map(np.array, zip(*found, strict=True))
    return Boxes(low, high, which, np.arange(count)), at


def within(parts, part, place):
    """The place in a part, in its child there, the child of that, and so on."""
    while part >= 0:
        yield part, place
        axis, place = parts.axis[part] - 2, place.copy()
        side = int(place[axis] > 0.0)
        place[axis] = 2.0 * place[axis] + (1.0, -1.0)[side]
        part = int(parts.children[part, side])


def lost(case):
    """(m,) boxes that the verifier drops, or contracts or cuts so that the place is outside."""
    left, models, _ = case.emptiness.examine(case.boxes)
    parts = case.emptiness.parts
    made = smaller(left, models, parts, case.emptiness.allowed.length)
    missed = np.ones(len(case.boxes), dtype=bool)
    at = [
        dict(within(parts, part, place))
        for part, place in zip(case.boxes.part.tolist(), case.places, strict=True)
    ]
    for i, (box, part) in enumerate(zip(made.claim.tolist(), made.part.tolist(), strict=True)):
        place = at[box].get(part)
        if place is not None:
            held = (place >= made.low[i] - 1e-15) & (place <= made.high[i] + 1e-15)
            missed[box] &= not held.all()
    return missed


@sampled("seed", seeds(4, all=120))
def test_no_box_around_a_known_place_is_lost(seed):
    rng = np.random.default_rng(seed)
    for boxes in (1, 40, 150, 150, 150, 150, 150, 150):
        assert not lost(known(rng, boxes)).any()


class NoRefutation:
    """A search for refutations that finds none, so that the bounds alone have to refuse."""

    def find(self, *_):
        """Nothing."""


@sampled("seed", seeds(1, all=40))
def test_no_region_around_a_known_place_is_said_to_be_empty(seed):
    """Joints that turn may be some turns away from it: the tool is at the same place there."""
    rng = np.random.default_rng(seed)
    for _ in range(6):
        case = known(rng, 1)
        q, arm = case.places[0][:-2], case.emptiness.kinematics.robot
        for _ in range(3):
            size = np.exp(rng.uniform(np.log(1e-6), np.log(8.0), (2, arm.n)))
            size[:, rng.random(arm.n) < 0.2] = 0.0
            turns = np.where(arm.prismatic, 0, 2.0 * np.pi * rng.integers(-1, 2, arm.n))
            region = JointRegion(q - size[0] + turns, q + size[1] + turns)
            claims = [Claim("a region", region, None, 0)]
            assert case.emptiness.test(claims, NoRefutation(), 600).refusal


UR5 = load_robot("ur5")


@pytest.mark.parametrize("size", [0.02, 0.3])
def test_models_hold_over_their_boxes_and_hardly_less_would(size):
    """Of tool point and axis: each joint alone, of which the lemma is nearly exact, and all."""
    rng, dome = np.random.default_rng(1), sphere(0.3, (0, 25), (0, 360), **OUT)
    task = Task(0.02, 20)
    parts = target_parts(dome.parts(0.01, 0.05), dome.cells(1, 1), task)
    part = int(np.argmin(parts.radius[:, 0]))
    allowed = linear_models.Allowed(0.0, 0.0, 0.5)
    for halves in (*(size * np.eye(6)[:5]), np.full(6, 0.2 * size)):
        q, x = rng.uniform(-1.5, 1.5, 6), rng.uniform(-0.5, 0.5, 2)
        centre, half = np.append(q, x), np.append(halves, [0.4, 0.4])
        box = Boxes((centre - half)[None], (centre + half)[None], *np.array([[part], [0]]))
        made = models_of(Kinematics(UR5), box, parts, allowed)
        d = rng.uniform(-1, 1, (300, 8))
        d = np.where(rng.random(d.shape) < 0.5, np.sign(d), d) * half
        points, axes = Kinematics(UR5).tools(q + d[:, :6])
        aim = parts.centre[part] + (x + d[:, 6:]) @ parts.slopes[part]
        truth = np.hstack([points - aim[:, :3], 0.5 * (axes - aim[:, 3:])])
        off = np.linalg.norm(
            (truth - made.residual[0] - d @ made.columns[0]).reshape(-1, 2, 3), axis=2
        )
        own = made.radius[0] - [parts.radius[part, 0], 0.5 * parts.radius[part, 1]]
        if (halves > 0).all():
            assert (off <= own + 1e-12).all()
        else:
            holds(own, off.max(axis=0), 0.9)


def test_targets_are_off_by_what_points_are_and_what_normals_move_them():
    """T = f + d n, so r_T = r_f + d r_n; the approach is off as the normal is."""
    dome = sphere(1.0, (10, 60), (0, 90))
    parts, cells = dome.parts(0.05, 0.05), dome.cells(2, 2)
    for standoff in (0.0, 0.3):
        found = target_parts(parts, cells, Task(standoff, 30))
        assert found.radius[:, 0] == pytest.approx(parts.radius @ [1.0, standoff])
        assert (found.radius[:, 1] == parts.radius[:, 1]).all()
    fixed = target_parts(parts, cells, Task(0.3, 30, approach=(0.0, 0.0, -1.0)))
    assert fixed.radius[:, 0] == pytest.approx(parts.radius @ [1.0, 0.3])
    assert not fixed.radius[:, 1].any()


def test_bodies_are_asked_to_overlap_wherever_the_target_of_a_box_may_be():
    """Off its middle by the tolerance, by what the part is off, and by all that x moves it."""
    dome, asked = sphere(0.3, (0, 25), (0, 360), **OUT), []

    class Asked:
        def deepest(self, low, high, target, off):
            asked.append((target, off))
            return Deepest(np.full(len(low), np.inf), np.zeros(low.shape), np.full(len(low), -1))

    parts = target_parts(dome.parts(0.01, 0.05), dome.cells(1, 1), Task(0.02, 20))
    part = int(np.argmax(parts.radius[:, 0]))
    allowed = linear_models.Allowed(10.0, 4.0, 0.5)  # so that nothing is excluded
    search = Emptiness(Kinematics(UR5), parts, allowed, lambda: None, Asked())
    q, x = np.zeros(6), np.array([0.3, -0.2])
    half = np.append(np.full(6, 1e-3), [0.5, 0.25])
    centre = np.append(q, x)
    search.examine(Boxes((centre - half)[None], (centre + half)[None], *np.array([[part], [0]])))
    ((target, off),) = asked
    slopes = parts.slopes[part][:, :3]
    assert target[0] == pytest.approx(parts.centre[part, :3] + x @ slopes)
    moved = 0.5 * np.linalg.norm(slopes[0]) + 0.25 * np.linalg.norm(slopes[1])
    assert off[0] == pytest.approx(10.0 + parts.radius[part, 0] + moved)
    assert min(parts.radius[part, 0], moved) > 1e-3


@pytest.mark.parametrize("axis", [-1, 0, 1])
def test_children_of_a_part_hold_all_of_it(axis):
    """Halves hold what is theirs; children of any other kind may hold a place anywhere."""
    parts = target_parts(plane((0, 1), (0, 1)).parts(1e-3, 0.1), plane((0, 1), (0, 1)).cells(1, 1),
                         Task(0.0, 20))  # fmt: skip
    many = [getattr(parts, name) for name in ("centre", "slopes", "radius")]
    parts = replace(
        parts,
        **{name: np.repeat(value[:1], 3, axis=0) for name, value in
           zip(("centre", "slopes", "radius"), many, strict=True)},
        children=np.array([[1, 2], [-1, -1], [-1, -1]]), axis=np.array([axis, -1, -1]),
    )  # fmt: skip
    low, high = np.array([[0.0, 0.2, -0.5]]), np.array([[1.0, 0.9, -0.1]])
    boxes = Boxes(low, high, np.zeros(1, int), np.zeros(1, int))
    made, _ = cut(boxes, np.array([[1e-9, 1.0, 1.0]]), parts, 0.5)
    at = {int(part): (made.low[k, 1:], made.high[k, 1:]) for k, part in enumerate(made.part)}
    if axis < 0:
        assert all(np.array_equal(at[k], [[-1.0, -1.0], [1.0, 1.0]]) for k in (1, 2))
        return
    (only,) = at  # 0.2 to 0.9 belongs to the second half, -0.5 to -0.1 to the first
    assert only == (2 if axis == 0 else 1)
    expected = (2 * np.array([0.2, 0.9]) - 1, 2 * np.array([-0.5, -0.1]) + 1)[axis]
    np.testing.assert_allclose([at[only][0][axis], at[only][1][axis]], expected)


@pytest.mark.parametrize("kind", KINDS)
@sampled("seed", seeds(1, all=10))
def test_parts_hold_the_places_of_their_surface_and_not_those_of_another(kind, seed):
    cells = cells_of(random_surface(kind, np.random.default_rng(seed)), 4, 5)
    parts = cells.surface.parts(1e-2, 0.1, 2000)
    assert disagreement(cells, parts) == ""
    size = np.ptp(cells.centres, axis=0).max()
    moved = replace(parts, centre=parts.centre + np.repeat([size, 0.0], 3))
    assert "lie on no part" in disagreement(cells, moved)
    turned = replace(parts, centre=parts.centre * np.repeat([1.0, -1.0], 3))
    if parts.radius[parts.children[:, 0] < 0, 1].max() < 0.5:  # else normals may be anything
        assert "lie on no part" in disagreement(cells, turned)
    unknown = replace(parts, radius=np.full_like(parts.radius, np.nan))
    assert "lie on no part" in disagreement(cells, unknown)


@pytest.mark.parametrize("off", [1e-3, 0.02])
def test_a_part_that_is_missing_or_a_little_off_is_noticed(off):
    cells = plane((0.0, 1.0), (0.0, 1.0)).cells(10, 10)
    parts = cells.surface.parts(1e-3, 0.1)
    halves = replace(
        parts,
        centre=np.vstack([parts.centre[:1], parts.centre[:1] - [0.25, 0, 0, 0, 0, 0]]),
        slopes=np.vstack([parts.slopes[:1], parts.slopes[:1] * [[[0.5], [1.0]]]]),
        radius=np.vstack([parts.radius[:1]] * 2),
        children=np.array([[1, 1], [-1, -1]]), axis=np.array([-1, -1]),
    )  # fmt: skip
    points, normals = places(cells, 300)
    held = parts_agreement.on_a_finest_part(np.concatenate([points, normals], axis=1), halves)
    np.testing.assert_array_equal(held, points[:, 0] <= 0.5)
    lifted = replace(parts, centre=parts.centre + off * np.append(Z, [0, 0, 0]))
    assert "lie on no part" in disagreement(cells, lifted)
