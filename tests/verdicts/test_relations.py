"""Questions whose answers have a known relation: the same asked otherwise, or less asked."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import plain
import pytest
from asked import built, question, tables_of, verdict_of
from samples import sampled, seeds, spread

from coverable import CauseKind, Obstacle, Robot, check, load_robot
from feasibility.verdict import Answer
from robots.pinocchio_model import joint_axes
from surfaces.surface import rotation_from_rpy

ALIKE = (
    ("4d as a cone", "paper 4d"),
    ("5a as an ellipsoid", "paper 5a"),
    ("coarse dome of points", "coarse dome"),
    ("coarse dome of points beyond reach", "coarse dome beyond reach"),
    ("waist of points", "waist"),
    ("waist of poses", "waist"),
    ("ring of poses", "ring"),
    ("a turntable that is held", "a turned plate"),
)
NEARLY = (("4a as a mesh", "paper 4a"), ("4d as a mesh", "paper 4d"), ("5e as a mesh", "paper 5e"),
          ("hood as a mesh", "hood"), ("4a in halves", "paper 4a"))  # fmt: skip
LESS = (  # asked less, or allowed more
    ("a turntable that is held", "on a turntable"),
    ("on a turntable", "on a rail and a turntable"),
    ("off the rail", "on a rail"),
    ("half turns", "full turns"),
    ("a square and a fixed tool", "a square and 15 degrees"),
    ("a large square and a stop of the wrist", "a large square, a stop and 15 degrees"),
    ("half a degree", "small dome"),
    ("small dome", "any axis"),
    ("a tenth of a millimetre", "plate"),
    ("plate", "a centimetre"),
    ("a wall 5e", "paper 5e"),
    ("paper 5c", "paper 5d"),
    ("4a within 15 degrees", "paper 4a"),
)
PROBLEMS = [f"puma560 {k}" for k in range(0, 270, 9)] + [f"ur5 {k}" for k in range(0, 34, 6)]


@pytest.mark.parametrize(("one", "other"), ALIKE)
def test_one_question_asked_otherwise_has_one_answer(one, other):
    one, other = verdict_of(one), verdict_of(other)
    assert (one.answer, one.evidence) == (other.answer, other.evidence)
    assert one.covered.tolist() == other.covered.tolist()


@sampled(("one", "other"), spread(NEARLY, 3))
def test_cells_that_lie_elsewhere_cover_as_much(one, other):
    one, other = verdict_of(one), verdict_of(other)
    assert (one.answer, one.evidence) == (other.answer, other.evidence)
    assert one.cells.areas.sum() == pytest.approx(other.cells.areas.sum(), rel=1e-3)
    shares = [v.cells.areas[v.covered].sum() / v.cells.areas.sum() for v in (one, other)]
    assert shares[0] == pytest.approx(shares[1], abs=0.03)
    assert one.statistics["fk"] <= 2 * other.statistics["fk"]


def no_less(narrow, wide):
    """Whatever the narrower question covers in one motion, the wider one does."""
    wider = [set(component.tolist()) for component in wide.components]
    for component in narrow.components[:1]:
        assert any(set(component.tolist()) <= other for other in wider)
    assert wide.n_covered >= narrow.n_covered
    assert not (narrow.feasible and wide.answer is Answer.INFEASIBLE)
    # A proof holds for all that is narrower. (A cell that a cut parts from the best motion is
    # proved too, but another motion covers it.)
    reached = {int(k) for component in narrow.components for k in component}
    lost = [cause for cause in wide.causes if cause.kind is not CauseKind.DISCONNECTED]
    assert not reached & {cause.cell for cause in lost if cause.proved}


@sampled(("narrow", "wide"), spread(LESS, 4))
def test_a_question_that_asks_less_loses_nothing(narrow, wide):
    no_less(verdict_of(narrow), verdict_of(wide))
    assert verdict_of(wide).statistics["fk"] <= 5 * verdict_of(narrow).statistics["fk"] + 2000


def wider(tables, what, rng):
    """A joint's limit up to 90 degrees further out; cone or tolerance up to three times wider."""
    robot, task = dict(tables["robot"]), dict(tables["task"])
    if what == "limit":
        limits = [list(pair) for pair in robot["limits_deg"]]
        end = int(rng.integers(2))
        limits[rng.integers(len(limits))][end] += (1 if end else -1) * float(rng.uniform(1, 90))
        robot["limits_deg"] = limits
    elif what == "cone":
        task["cone_deg"] = min(task["cone_deg"] * float(rng.uniform(1.05, 3.0)), 180.0)
    else:
        task["tolerance"] = task.get("tolerance", 1e-3) * float(rng.uniform(1.05, 3.0))
    return tables | {"robot": robot, "task": task}


@sampled("seed", seeds(1, all=3))
@pytest.mark.parametrize("what", ["limit", "cone", "tolerance"])
@pytest.mark.parametrize("name", spread(PROBLEMS, 2))
def test_what_is_wider_loses_nothing(name, what, seed):
    rng = np.random.default_rng([len(what), int(name.split()[1]), seed])
    no_less(verdict_of(name), check(*built(wider(tables_of(name), what, rng))))


@sampled("name", spread(PROBLEMS, 2))
def test_finer_cells_lose_only_new_ones(name):
    """Three times finer both ways: every centre is one of the finer centres."""
    q, coarse = question(name), verdict_of(name)
    nu, nv = q.cells.shape
    fine = check(q.robot, q.cells.surface.cells(3 * nu, 3 * nv), q.task)
    old = np.arange(9 * nu * nv).reshape(3 * nu, 3 * nv)[1::3, 1::3].ravel()
    component = set(coarse.components[0].tolist()) if coarse.components else set()
    kept = [set(np.flatnonzero(np.isin(old, c)).tolist()) for c in fine.components]
    assert not component or any(component <= cells for cells in kept)
    lost = {c.cell for c in fine.causes if c.proved and c.kind is not CauseKind.DISCONNECTED}
    assert not lost & {int(old[k]) for k in component}


def same(one, other):
    assert one.answer is other.answer
    assert one.n_covered == other.n_covered
    # Two components may cover as many cells: the same sets have to be there.
    mine = {frozenset(component.tolist()) for component in one.components} or {frozenset()}
    assert frozenset(np.flatnonzero(other.covered).tolist()) in mine
    if other.feasible:
        assert plain.faults_of(other) == []


@sampled("name", [*spread(PROBLEMS, 2), "beside a post", "torus"])
def test_moving_all_by_one_rigid_motion_changes_nothing(name):
    q, angles, shift = question(name), (0.4, -0.7, 1.9), np.array([0.5, -1.0, 0.3])
    motion = pin.SE3(rotation_from_rpy(*angles), shift)
    name_of = q.robot.name
    limits = np.column_stack([q.robot.lower, q.robot.upper])
    robot = load_robot(name_of, base=motion).with_limits(limits)
    surface = q.cells.surface.moved(motion.rotation, shift)
    task = q.task
    if task.collision is not None:
        scene = tuple(
            Obstacle(one.name, one.geometry, motion.homogeneous @ one.placement)
            for one in task.collision.scene
        )
        task = replace(task, collision=replace(task.collision, scene=scene))
    same(verdict_of(name), check(robot, surface.cells(*q.cells.shape), task))


@sampled("name", spread(PROBLEMS, 2))
def test_a_mirror_changes_nothing(name):
    """In the plane y = 0: turns run the other way, and one parameter of the surface does."""
    q, tables = question(name), tables_of(name)
    flip = np.diag([1.0, -1.0, 1.0])
    model = q.robot.model.copy()  # another world, the same joints
    for k, placed in enumerate(model.jointPlacements):
        model.jointPlacements[k] = pin.SE3(flip @ placed.rotation @ flip, flip @ placed.translation)
    for frame in model.frames:
        placed = frame.placement.copy()
        frame.placement = pin.SE3(flip @ placed.rotation @ flip, flip @ placed.translation)
    slides, axes = joint_axes(model)
    assert not slides.any()
    # A joint about y turns as before, one about x or z the other way round: q becomes -q.
    about_y = np.abs(axes[:, 1]) == 1.0
    assert (about_y | (axes[:, 1] == 0.0)).all()
    limits = np.column_stack([q.robot.lower, q.robot.upper])
    limits = np.where(about_y[:, None], limits, -limits[:, ::-1])
    kept = {name: getattr(q.robot, name) for name in Robot.__dataclass_fields__}
    arm = Robot(**(kept | {"model": model, "urdf": None})).with_limits(limits)
    surface, kind = dict(tables["surface"]), tables["surface"]["kind"]
    x, y, z = surface["position"]
    roll, pitch, yaw = surface["rpy_deg"]
    surface |= {"position": [x, -y, z], "rpy_deg": [-roll, pitch, -yaw]}
    key = {"plane": "v", "sphere": "v_deg"}.get(kind, "u_deg")
    surface[key] = [-surface[key][1], -surface[key][0]]
    cells = built(tables | {"surface": surface}).cells
    order = np.arange(len(cells)).reshape(cells.shape)
    order = (order[:, ::-1] if kind in ("plane", "sphere") else order[::-1]).ravel()
    np.testing.assert_allclose(cells.centres[order], q.cells.centres @ flip, atol=1e-9)
    one, other = verdict_of(name), check(arm, cells, q.task)
    assert (one.answer, one.n_covered) == (other.answer, other.n_covered)
