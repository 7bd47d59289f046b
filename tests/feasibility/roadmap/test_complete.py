"""The complete search at the edges of its domain: every one is decided, or says why not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from dense_replay import assert_witness, tools

from feasibility import Answer, CauseKind, Evidence, Search, Task, Verdict, check
from robots import Robot, load_robot
from surfaces import Surface, cylinder, hyperboloid, plane, sphere

PUMA = load_robot("puma560", limits="set-1")
UR5 = load_robot("ur5")
DOME = sphere(1.0, (30, 80), (10, 120))
PLATE = plane((0.35, 0.65), (-0.15, 0.15), "outside", (0.0, 0.0, 0.2))
FREE = np.tile([-np.inf, np.inf], (6, 1))


def assert_feasible(verdict: Verdict) -> None:
    assert (verdict.answer, verdict.evidence) == (Answer.FEASIBLE, Evidence.WITNESS)
    assert verdict.n_covered == len(verdict.cells)
    assert verdict.causes == ()
    assert_witness(verdict)


# cones and tolerances


@pytest.mark.parametrize("arm", [PUMA, UR5], ids=["puma560", "ur5"])
def test_a_cone_of_nothing_cannot_be_certified(arm: Robot) -> None:
    patch = DOME if arm is PUMA else PLATE
    verdict = check(arm, patch.cells(3, 3), Task(standoff=0.005, cone_deg=0))
    assert (verdict.answer, verdict.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert "cone of 0 degrees" in verdict.message
    assert verdict.witness is None


def test_a_cone_of_nothing_is_decided_where_a_cell_is_proved() -> None:
    far = sphere(3.0, (30, 80), (10, 120))
    verdict = check(PUMA, far.cells(2, 2), Task(standoff=0.005, cone_deg=0))
    assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)


@pytest.mark.parametrize("cone_deg", [0.5, 90, 179, 180])
def test_cones_from_narrow_to_everything(cone_deg: float) -> None:
    assert_feasible(check(PUMA, DOME.cells(4, 4), Task(standoff=0.005, cone_deg=cone_deg)))
    assert_feasible(check(UR5, PLATE.cells(4, 4), Task(standoff=0.01, cone_deg=cone_deg)))


@pytest.mark.parametrize("tolerance", [1e-5, 1e-4, 1e-2])
def test_tolerances_from_fine_to_coarse(tolerance: float) -> None:
    task = Task(standoff=0.005, cone_deg=30, tolerance=tolerance)
    for arm, patch in ((PUMA, DOME), (UR5, PLATE)):
        verdict = check(arm, patch.cells(3, 4), task)
        assert_feasible(verdict)
        assert verdict.certificate is not None
        assert verdict.certificate.max_position_error <= tolerance


def test_a_finer_tolerance_needs_more_waypoints() -> None:
    waypoints = []
    for tolerance in (1e-5, 1e-3):
        verdict = check(PUMA, DOME.cells(3, 3), Task(0.005, 30, tolerance))
        assert verdict.certificate is not None
        waypoints.append(verdict.certificate.waypoints)
    assert waypoints[0] > 3 * waypoints[1]


# grids


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (2, 1), (1, 2), (2, 2)])
@pytest.mark.parametrize(("arm", "patch"), [(PUMA, DOME), (UR5, PLATE)], ids=["dome", "plate"])
def test_small_grids(arm: Robot, patch: Surface, shape: tuple[int, int]) -> None:
    verdict = check(arm, patch.cells(*shape), Task(standoff=0.01, cone_deg=30))
    assert_feasible(verdict)
    assert verdict.n_edges == len(verdict.cells.pairs)


@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (5, 0)])
def test_no_cells_at_all_are_covered(shape: tuple[int, int]) -> None:
    verdict = check(PUMA, DOME.cells(*shape), Task(standoff=0.005, cone_deg=30))
    assert (verdict.answer, verdict.evidence) == (Answer.FEASIBLE, Evidence.WITNESS)
    assert (verdict.n_covered, verdict.n_edges, verdict.causes) == (0, 0, ())
    assert len(verdict.graph) == 0


@pytest.mark.parametrize("columns", [1, 2, 3, 4, 5, 9])
def test_closed_cylinders(columns: int) -> None:
    """A pipe all around the arm's column; the seam is no border."""
    pipe = cylinder(0.6, (-180, 180), (0.0, 0.3))
    verdict = check(PUMA.with_limits(FREE), pipe.cells(columns, 2), Task(0.02, 40))
    assert_feasible(verdict)


@pytest.mark.parametrize("rows", [1, 2, 3])
@pytest.mark.parametrize("columns", [1, 2, 3, 4, 6])
def test_a_cap_with_its_pole(rows: int, columns: int) -> None:
    cap = sphere(0.4, (0, 60), (-180, 180), position=(0.5, 0.4, 0.0))
    verdict = check(PUMA.with_limits(FREE), cap.cells(rows, columns), Task(0.02, 60))
    assert_feasible(verdict)


@pytest.mark.parametrize("columns", [2, 3, 4, 5])
@pytest.mark.parametrize("high", [180, 210], ids=["open", "closed"])
@pytest.mark.parametrize("arm", [PUMA, UR5], ids=["puma560", "ur5"])
def test_coarse_rings_stay_on_their_patch(arm: Robot, high: float, columns: int) -> None:
    """Between far centres the straight line leaves the ring; so would its closest points."""
    ring = sphere(0.7, (30, 60), (-150, high))
    verdict = check(arm.with_limits(FREE), ring.cells(3, columns), Task(0.02, 60))
    assert_feasible(verdict)


def test_a_full_sphere_from_outside_is_reached_on_its_near_side() -> None:
    ball = sphere(0.15, (0, 180), (-180, 180), "outside", (0.55, 0.3, 0.3))
    verdict = check(PUMA, ball.cells(6, 8), Task(0.02, 60))
    assert verdict.answer is not Answer.UNDECIDED
    assert verdict.n_covered > 0
    if verdict.feasible:
        assert_witness(verdict)


# limits


@pytest.mark.parametrize("turns", [1.0, 5.0, math.inf])
def test_wide_limits(turns: float) -> None:
    wide = 2.0 * np.pi * turns * np.tile([-1.0, 1.0], (6, 1))
    for arm, patch in ((PUMA, DOME), (UR5, PLATE)):
        assert_feasible(check(arm.with_limits(wide), patch.cells(3, 4), Task(0.01, 20)))


def test_a_limit_of_more_than_half_a_turn_off_is_not_wrapped() -> None:
    """120 .. 240 degrees is a range about 180, not two ranges."""
    patch = cylinder(0.6, (150, 210), (0.0, 0.3))
    offset = math.asin(0.1 / 0.58)
    for low, high in ((120.0, 240.0), (-240.0, -120.0)):
        arm = PUMA.with_limits(
            {"joint1": (math.radians(low) - offset, math.radians(high) - offset)}
        )
        verdict = check(arm, patch.cells(4, 3), Task(0.02, 40))
        assert_feasible(verdict)


def test_a_stop_in_the_seam_is_a_stop() -> None:
    """A closed ring needs joint1 to go all round: feasible, if never over the stop."""
    ring = cylinder(0.6, (-180, 180), (0.0, 0.2))
    task = Task(0.02, 40)
    turn = check(PUMA.with_limits({"joint1": (-np.pi, np.pi)}), ring.cells(8, 1), task)
    assert_feasible(turn)
    assert turn.n_edges < len(turn.cells.pairs)
    assert turn.witness is not None
    assert np.ptp(turn.witness.q[:, 0]) <= 2 * np.pi
    short = check(PUMA.with_limits({"joint1": (-2.0, 2.0)}), ring.cells(8, 1), task)
    assert not short.feasible or np.ptp(short.witness.q[:, 0]) <= 4.0  # type: ignore[union-attr]


def test_joints_that_are_held() -> None:
    """Limits of no width leave a planar arm of three joints."""
    arm = PUMA.with_limits({"joint1": (0.0, 0.0), "joint4": (0.0, 0.0), "joint6": (0.0, 0.0)})
    # The forearm's plane is y = 0.1: a plate's middle row lies in it, the others do not.
    plate = plane((0.5, 0.9), (0.0, 0.2), "inside", (0.0, 0.0, 0.3))
    inline = check(arm, plate.cells(4, 1), Task(0.01, 60))
    assert_feasible(inline)
    beside = check(arm, plate.cells(4, 3), Task(0.01, 60))
    assert (beside.answer, beside.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
    np.testing.assert_array_equal(beside.covered.reshape(4, 3), [[False, True, False]] * 4)


# singular targets


def singular(q_deg: tuple[float, ...], half: float = 0.1) -> Surface:
    """A plate whose middle is where the tool is at q, to be worked on along the tool's axis."""
    q = np.radians(q_deg)
    points, axes = tools(PUMA, q[None])
    axis = axes[0]
    side = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.7 else [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    rotation = np.column_stack([side, np.cross(axis, side), axis])
    return plane((-half, half), (-half, half), "inside").moved(rotation, points[0])


@pytest.mark.parametrize("cone_deg", [2, 20])
@pytest.mark.parametrize(
    "q_deg",
    [(20, -40, 20, 0, 0, 0), (20, -30, 30, 30, 0, -30), (-70, -60, 10, 90, 0, 0)],
)
def test_targets_at_the_wrist_singularity(q_deg: tuple[float, ...], cone_deg: float) -> None:
    patch = singular(q_deg)
    # The Jacobian has lost a rank there: axes 4 and 6 coincide.
    verdict = check(PUMA, patch.cells(3, 3), Task(0.0, cone_deg))
    assert_feasible(verdict)


def test_targets_at_full_stretch_are_reached_and_those_beyond_proved() -> None:
    """Targets at, beyond and short of the distance at which the arm is stretched out."""
    q = np.zeros((3, 6))
    q[:, 2] = -math.atan2(0.7, 0.1) + np.array([0.0, 0.05, -0.05])  # first: in one line
    points, _ = tools(PUMA, q)
    reached = np.linalg.norm(points, axis=1)
    assert reached[0] > reached[1:].max()
    radius = float(reached[0])
    reach = sphere(radius, (60, 120), (-40, 40))
    on = check(PUMA, reach.cells(3, 3), Task(0.0, 120))
    assert on.answer is not Answer.UNDECIDED
    assert on.n_covered > 0
    beyond = check(PUMA, sphere(radius + 0.003, (60, 120), (-40, 40)).cells(3, 3), Task(0.0, 120))
    assert (beyond.answer, beyond.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
    assert beyond.n_covered == 0
    assert {cause.kind for cause in beyond.causes} == {CauseKind.OUT_OF_REACH}
    short = check(PUMA, sphere(radius - 0.003, (60, 120), (-40, 40)).cells(3, 3), Task(0.0, 120))
    assert_feasible(short)


def test_a_target_over_the_shoulder_singularity() -> None:
    """The wrist's plane misses the first axis by 0.1 m: inside that cylinder nothing reaches."""
    inside = plane((-0.06, 0.06), (-0.06, 0.06), "inside", (0.0, 0.0, 0.6))
    verdict = check(PUMA, inside.cells(3, 3), Task(0.0, 90))
    assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
    assert verdict.n_covered == 0
    border = cylinder(0.1, (-60, 60), (0.5, 0.7))  # exactly on it
    on = check(PUMA, border.cells(3, 3), Task(0.0, 120))
    assert on.answer is not Answer.UNDECIDED
    outside = cylinder(0.11, (-60, 60), (0.5, 0.7))
    assert_feasible(check(PUMA, outside.cells(3, 3), Task(0.0, 120)))


# surfaces that cannot be had


@pytest.mark.parametrize(
    "patch",
    [
        sphere(3.0, (30, 80), (0, 90)),
        plane((5.0, 5.4), (0.0, 0.3)),
        cylinder(0.2, (-180, 180), (4.0, 4.5)),
        hyperboloid(0.4, 0.5, (0, 90), (2.0, 2.2)),
    ],
    ids=["sphere", "plane", "cylinder", "hyperboloid"],
)
def test_a_surface_out_of_reach_is_proved_so(patch: Surface) -> None:
    for arm in (PUMA, UR5):
        verdict = check(arm, patch.cells(4, 5), Task(0.01, 45))
        assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
        assert (verdict.n_covered, verdict.n_edges) == (0, 0)
        assert [cause.cell for cause in verdict.causes] == list(range(20))
        assert {cause.kind for cause in verdict.causes} == {CauseKind.OUT_OF_REACH}
        assert all(cause.proved for cause in verdict.causes)


@pytest.mark.parametrize(
    "patch",
    [
        sphere(0.1, (30, 80), (0, 90), position=(0.5, 0.3, 0.2)),
        cylinder(0.1, (0, 90), (0.0, 0.3), position=(0.5, 0.3, 0.2)),
        hyperboloid(0.1, 0.5, (0, 90), (0.0, 0.3), position=(0.5, 0.3, 0.2)),
    ],
    ids=["sphere", "cylinder", "hyperboloid"],
)
@pytest.mark.parametrize("standoff", [0.101, 0.15])
def test_a_standoff_beyond_the_centre_of_curvature_is_not_certified(
    patch: Surface, standoff: float
) -> None:
    verdict = check(PUMA, patch.cells(3, 3), Task(standoff, 45))
    assert (verdict.answer, verdict.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert "folds" in verdict.message


def test_the_time_limit_of_an_easy_case_is_not_reached() -> None:
    verdict = check(PUMA, DOME.cells(3, 3), Task(0.005, 45), Search(time_limit=3600.0))
    assert_feasible(verdict)
