"""Placements: found where there are some, and again by `check`; refused where a bound shows it."""

import json
import math
import multiprocessing
from dataclasses import replace
from functools import cache
from itertools import count
from unittest.mock import Mock

import numpy as np
import pytest
from asked import question
from hypothesis import given, settings
from hypothesis import strategies as st
from jobs import PLATE, run_coverable
from referee import unit
from samples import sampled, spread

import coverable
from coverable import Answer, Evidence, Pose, Region, Search, check, evaluator_here, place, plane
from feasibility.division.plans import motion_over
from feasibility.placement.reach_bound import Reach
from feasibility.placement.region import AXES, PlacementError, moved_cells
from feasibility.placement.trials import Trial, evaluator_of_study, search_with
from surfaces.surface import rotation_from_rpy

SHIFT, TURN_DEG = 0.3, 40.0  # [m], [deg] that a surface is moved by, at most
WIDTHS = np.array([SHIFT] * 3 + [TURN_DEG] * 3)
PUMA = 'robot = { name = "puma560", limits = "set-1" }\n'
TEXTS = {
    "puma560 dome": PUMA + """
surface = { kind = "sphere", radius = 1.0, u_deg = [20, 80], v_deg = [40, 130], cells = [4, 5] }
task = { standoff = 0.005, cone_deg = 25 }""",
    "puma560 pipe": PUMA + """
surface = { kind = "cylinder", radius = 0.5, u_deg = [-40, 40], v = [0.1, 0.6], cells = [5, 4] }
task = { standoff = 0.005, cone_deg = 30 }""",
    "ur5 plate": """
robot.name = "ur5"
surface = { kind = "plane", u = [-0.25, 0.25], v = [-0.2, 0.2], cells = [5, 4], \
position = [0.5, 0, 0.2], side = "outside" }
task = { standoff = 0.02, cone_deg = 20 }""",
    "ur5 pipe": """
robot.name = "ur5"
surface = { kind = "cylinder", radius = 0.15, u_deg = [100, 260], v = [-0.2, 0.2], \
position = [0.65, 0, 0.3], side = "outside", cells = [5, 4] }
task = { standoff = 0.02, cone_deg = 20 }""",
    "panda plate": """
robot.name = "panda"
surface = { kind = "plane", u = [-0.2, 0.2], v = [-0.2, 0.2], cells = [4, 4], \
position = [0.5, 0, 0.2], side = "outside" }
task = { standoff = 0.02, cone_deg = 15 }""",
}  # fmt: skip
MOVED = [("ur5 plate", 3), ("puma560 pipe", 21), ("ur5 pipe", 8), ("panda plate", 3),
         ("puma560 dome", 12), ("puma560 dome", 21), ("puma560 pipe", 2), ("ur5 pipe", 3),
         ("ur5 pipe", 15), ("ur5 plate", 9), ("panda plate", 10)]  # fmt: skip


@cache
def case_of(name):
    return coverable.Case.from_toml(TEXTS[name], name=name)


@cache
def setup_of(name):
    return case_of(name).build()


def moved_away(name, seed):
    """A pose up to 0.3 m and 40 degrees, along and about each axis, from where the surface is."""
    own = Pose.of_surface(setup_of(name).cells.surface).values
    shift = np.random.default_rng([7, seed]).uniform(-1.0, 1.0, 6) * WIDTHS
    return Pose.of_values(np.round(own + shift, 6))


def region_about(pose, widths=WIDTHS):
    ends = zip(AXES, pose.values.tolist(), widths, strict=True)
    return Region.around(pose, {name: (v - w, v + w) for name, v, w in ends})


def case_at(name, pose):
    position, rpy = list(pose.position), list(pose.rpy_deg)
    sets = [f"surface.position={position}", f"surface.rpy_deg={rpy}"]
    return case_of(name).with_overrides(sets).build()


@sampled(("name", "seed"), spread(MOVED, 1))
def test_a_surface_moved_away_is_put_back(name, seed):
    """Infeasible where it was moved to; in the region around there is a place, and check agrees."""
    away = moved_away(name, seed)
    moved = case_at(name, away)
    assert check(*moved).answer is Answer.INFEASIBLE
    region = region_about(away)
    found = place(*moved[:3], region, moved.search, count=16, rounds=2, keep=2)
    assert (found.answer, found.evidence) == (Answer.FEASIBLE, Evidence.WITNESS)
    for trial in found.found:
        assert region.holds(trial.pose)
        assert check(*case_at(name, trial.pose)).feasible
        assert (trial.feasible, trial.share) == (True, 1.0)
    margins = [trial.margin for trial in found.found]
    assert margins == sorted(margins, reverse=True)
    best = found.found[0]
    again = check(*case_at(name, best.pose)[:3], search_with(best.effort, moved.search, 20))
    assert found.best.margin == again.certificate.placement_margin.position > 0.0


def test_a_region_far_away_is_refused_by_the_bound_alone():
    for name in TEXTS:
        setup = setup_of(name)
        far = Pose.of_surface(setup.cells.surface).values + np.array([3.0, 0, 0, 0, 0, 0])
        region, nobody = region_about(Pose.of_values(far)), Mock(side_effect=AssertionError)
        found = place(*setup[:3], region, setup.search, evaluator=nobody)
        assert (found.answer, found.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
        assert (found.cause, found.found) == (coverable.CauseKind.OUT_OF_REACH, ())


def test_what_check_does_not_say_is_no_answer():
    setup = setup_of("panda plate")
    region = region_about(Pose.of_surface(setup.cells.surface))
    setup = setup._replace(search=Search(evaluations=1))  # with which `check` decides nothing
    doubted = place(*setup[:3], region, setup.search, count=8, rounds=1, keep=1)
    assert {trial.answer for trial in doubted.trials} == {Answer.UNDECIDED}
    assert (doubted.answer, doubted.found) == (Answer.UNDECIDED, ())


def stopping(setup, after, error):
    """An evaluator that raises an error in place of the trial after so many."""
    here, tried = evaluator_here(*setup), count()

    def evaluator(poses, effort):
        for trial in here(poses, effort):
            if next(tried) == after:
                raise error
            yield trial

    return evaluator


def test_what_covers_more_leads_to_what_covers_all():
    """A share that falls by the way from one place: trials come within 0.1 mm of it."""
    setup = setup_of("ur5 plate")
    own = Pose.of_surface(setup.cells.surface)
    x = own.position[0] + 0.0321

    def evaluator(poses, effort):
        for pose in poses:
            yield Trial(pose, {"message": "", "share": 1.0 - abs(pose.position[0] - x)})

    region = Region.around(own, {"x": (own.position[0], own.position[0] + 0.1)})
    found = place(*setup[:3], region, setup.search, count=8, rounds=20, evaluator=evaluator)
    assert found.best.share >= 1.0 - 1e-4


def test_a_ctrl_c_ends_it_with_the_best_so_far():
    setup = setup_of("ur5 plate")
    region = Region.around(Pose.of_surface(setup.cells.surface), {"x": (0.0, 0.3)})
    ended = stopping(setup, 20, KeyboardInterrupt)
    found = place(*setup[:3], region, setup.search, evaluator=ended, interruptible=True)
    assert (found.answer, found.interrupted) == (Answer.FEASIBLE, True)
    assert len(found.trials) == 20
    assert found.best.margin == max(trial.margin for trial in found.trials) > 0.0
    assert check(*case_at("ur5 plate", found.best.pose)).feasible
    for error in (KeyboardInterrupt, ValueError("of an evaluator")):
        with pytest.raises(type(error) if error is not KeyboardInterrupt else error) as told:
            place(*setup[:3], region, setup.search, evaluator=stopping(setup, 3, error))
        assert error is KeyboardInterrupt or told.value is error


WALL_AT, RADIUS, CLEARANCE = 0.8, 0.05, 0.01  # m
ROOM = WALL_AT - 0.5 - RADIUS - CLEARANCE
"""m that the surface may move towards the wall, with a ball around the tool point."""


def test_no_place_is_feasible_whose_motion_would_not_stay_clear():
    cells = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3)).cells(1, 2)
    back, robot = (0.0, -90.0, 0.0), coverable.load_robot("ur5")
    wall = coverable.Obstacle.halfspace("wall", position=(WALL_AT, 0.0, 0.0), rpy_deg=back)
    asked = coverable.Collision(
        self_=False, clearance=CLEARANCE, scene=(wall,), tool=(coverable.ToolShape.sphere(RADIUS),),
        allow=(("tool", "surface"),),
    )  # fmt: skip
    region = Region.around(Pose.of_surface(cells.surface), {"x": (0.0, 2.0 * ROOM)})
    beside = coverable.Task(0.02, 30, 0.001, collision=asked)
    found = place(robot, cells, beside, region, count=6, rounds=0, keep=3)
    assert max(trial.pose.position[0] for trial in found.trials) > ROOM + 0.001
    assert max(trial.pose.position[0] for trial in found.found) <= ROOM + 0.001
    free = evaluator_here(robot, cells, replace(beside, collision=None), Search())
    (trial,) = free([Pose((ROOM + 0.05, 0.0, 0.3), (0.0, 0.0, 0.0))], False)
    assert trial.feasible


def test_the_bound_on_a_region_holds_for_its_placements():
    """Against samples and corners of regions, some near the edge of reach; and it proves some."""
    proved = several = 0
    reaches = [Reach.of(*setup_of(name)[:3]) for name in TEXTS]
    picks = np.array(np.meshgrid(*[[0, 1]] * 6)).reshape(6, -1).T
    tight = []
    for k in range(40):
        reach, rng = reaches[k % len(reaches)], np.random.default_rng([21, k])
        far = unit(rng.normal(size=3)) * rng.uniform(0.8, 1.6) * (reach.reach + 0.3)
        centre = np.concatenate([far, rng.uniform(-180.0, 180.0, 3)])
        region = region_about(Pose.of_values(centre), rng.uniform(0.0, [0.4] * 3 + [40.0] * 3))
        beyond = reach.beyond(region)
        corners = np.where(picks == 0, region.low, region.high)
        furthest = reach.distances(np.vstack([region.samples(16, k), corners])).max(axis=1)
        if beyond is not None:
            assert furthest.min() >= beyond[0] - 1e-9
            assert beyond[0] > reach.reach + reach.tolerance
            proved += 1
            several += beyond[1] > 1
            tight.append(beyond[0] / furthest.min())
        else:  # a pose in reach, or nearly so
            assert furthest.min() <= 1.05 * (reach.reach + reach.tolerance)
    assert 10 < proved < 40
    assert several > 2
    assert max(tight) > 0.97


def test_distances_are_those_of_the_targets_and_what_is_discarded_is_infeasible():
    setup = setup_of("ur5 plate")
    robot, cells, task, _ = setup[:4]
    reach = Reach.of(robot, cells, task)
    origin = robot.model.jointPlacements[1].translation
    region = Region.around(Pose.of_surface(cells.surface), {"x": (0.5, 1.4), "z": (0, 0.5)})
    discarded = 0
    for row in region.samples(16, 0):
        moved = moved_cells(cells, Pose.of_values(row))
        away = np.linalg.norm(task.targets(moved).points - origin, axis=1)
        assert reach.distances(row[None])[0] == pytest.approx(away, abs=1e-12)
        out = away > robot.reach + 0.001
        assert (reach.within(row[None])[0] == ~out).all()
        if out.any():
            areas, share = moved.areas, float(reach.share(row[None])[0])
            assert share == pytest.approx(areas[~out].sum() / areas.sum())
            verdict = check(robot, moved, task)
            assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
            assert areas[verdict.covered].sum() <= share * areas.sum() + 1e-12
            discarded += 1
    assert 3 < discarded < 17


def test_moved_cells_are_those_of_the_case():
    for name in TEXTS:
        for seed in range(2):
            pose = moved_away(name, seed)
            built, moved = case_at(name, pose).cells, moved_cells(setup_of(name).cells, pose)
            for field in ("centres", "normals", "areas"):
                assert (getattr(moved, field) == getattr(built, field)).all()
            assert (moved.curves.cubics == built.curves.cubics).all()


@pytest.mark.parametrize("name", ["4a as a mesh", "dome of halves"])
def test_cells_of_meshes_and_of_pieces_move_with_their_surface(name):
    cells = question(name).cells
    moved = moved_cells(cells, Pose((0.1, -0.2, 0.3), (10.0, 20.0, 30.0)))
    own, again = (
        ((one.centres - one.surface.position) @ one.surface.rotation,
         one.normals @ one.surface.rotation) for one in (cells, moved)
    )  # fmt: skip
    np.testing.assert_allclose(again, own, atol=1e-12)
    assert np.abs(moved.surface.closest(moved.centres).height).max() < 1e-9


@pytest.mark.parametrize(("name", "seed"), [("ur5 plate", 9), ("puma560 dome", 12)])
def test_what_a_place_is_said_to_cover_one_motion_covers(name, seed):
    """Each component is replayed over the moved cells; what no search found is not."""
    setup = setup_of(name)
    pose, areas = moved_away(name, seed), setup.cells.areas
    (trial,) = evaluator_here(*setup)([pose], "quickly")
    quick = search_with("quickly", setup.search, len(setup.cells))
    moved = setup.robot, moved_cells(setup.cells, pose), setup.task
    assert len(trial.covers)
    assert trial.share == pytest.approx(areas[trial.covers[0]].sum() / areas.sum())
    for cover in trial.covers[:3]:
        assert motion_over(*moved, quick, cover)[1] == ""
    more = np.ones(len(setup.cells), dtype=bool)
    assert trial.feasible or "did not find" in motion_over(*moved, quick, more)[1]


def test_stations_share_out_what_no_placement_covers_alone(tmp_path):
    """Every cell to exactly one station, each with a replayed motion, two at the proven least."""
    (tmp_path / "plate.toml").write_text(PLATE)
    long = ["surface.u=[-0.1, 0.1]", "surface.v=[-0.9, 0.9]", "surface.cells=[1, 9]",
            "surface.position=[0.5, 0, 0.3]"]  # fmt: skip
    sets = [part for text in long for part in ("--set", text)]
    said = run_coverable(
        "place", tmp_path / "plate.toml", *sets, "--y", -0.6, 0.6, "--count", 8, "--stations",
        "--json", "--workers", 0,
    )  # fmt: skip
    told = json.loads(said.out)["stations"]
    assert said.status == 1
    assert sorted(cell for one in told["stations"] for cell in one["cells"]) == list(range(9))
    assert all(one["certified"] for one in told["stations"])
    assert (told["left_out"], told["optimal"]) == ([], True)
    assert len(told["stations"]) == told["at_least"] == 2


def told(trials):
    return [(trial.pose, trial.effort, dict(trial.result)) for trial in trials]


def test_who_tries_placements_changes_nothing_and_what_fails_is_undecided(monkeypatch):
    fork = multiprocessing.get_context("fork")  # a worker that begins loaded
    monkeypatch.setattr(multiprocessing, "get_context", lambda _: fork)
    case, setup = case_of("ur5 plate"), setup_of("ur5 plate")
    region = region_about(moved_away("ur5 plate", 3))
    ask, number = {"count": 4, "rounds": 1, "keep": 1}, len(setup.cells)
    here = place(*setup[:3], region, setup.search, **ask)
    with coverable.open_workers(1) as workers:
        there = evaluator_of_study(case, number, workers)
        found = place(*setup[:3], region, setup.search, evaluator=there, **ask)
        assert told(found.trials) == told(here.trials)
        arm = replace(case.robot, name="no such arm")
        lost = evaluator_of_study(replace(case, robot=arm), number, workers)
        nothing = place(*setup[:3], region, evaluator=lost, count=4, rounds=0)
    assert nothing.answer is Answer.UNDECIDED
    assert "could not be tried" in nothing.message


def test_a_map_tells_what_single_placements_tell():
    setup = setup_of("panda plate")
    evaluator, own = evaluator_here(*setup), Pose.of_surface(setup.cells.surface)
    region = Region.around(own, {"x": (0.3, 1.2), "y": (-0.3, 0.3), "yaw_deg": (-40, 40)})
    chart = coverable.placement_map(evaluator, region, own, shape=(2, 2, 2))
    assert chart.axes == ("x", "y", "yaw_deg")
    for index in np.ndindex(2, 2, 2):
        values = chart.held.values
        for axis, ticks, k in zip(chart.axes, chart.ticks, index, strict=True):
            values[list(AXES).index(axis)] = ticks[k]
        (trial,) = evaluator([Pose.of_values(values)], "fully")
        assert (chart.share[index], chart.margin[index]) == (trial.share, trial.margin)
    assert chart.share.max() == 1.0 > chart.share.min()
    with pytest.raises(PlacementError, match="z: does not vary"):
        coverable.placement_map(evaluator, region, chart.held, axes=("x", "z"))


ANGLES = st.floats(-180.0, 180.0)


@settings(max_examples=25)
@given(ANGLES, st.one_of(st.floats(-90.0, 90.0), st.sampled_from([-90.0, 90.0])), ANGLES)
def test_a_surface_says_where_it_stands(roll, pitch, yaw):
    surface = plane((0, 1), (0, 1), position=(1, 2, 3), rpy_deg=(roll, pitch, yaw))
    pose = Pose.of_surface(surface)
    assert pose.position == (1.0, 2.0, 3.0)
    assert pose.rotation == pytest.approx(surface.rotation, abs=1e-7)
    assert rotation_from_rpy(*np.radians(pose.rpy_deg)) == pytest.approx(pose.rotation)


def test_samples_lie_in_the_region_and_fill_it():
    held = Pose((0.1, 0.2, 0.3), (0.0, 0.0, 0.0))
    region = Region.around(held, {"x": (-1 / 3, 1 / 3), "yaw_deg": (-0.0000004, 90)})
    values = region.samples(64, 5)
    assert len(values) >= 64
    assert all(region.holds(Pose.of_values(row), 0.0) for row in values)
    assert (values[:, [1, 2, 3, 4]] == np.array([0.2, 0.3, 0.0, 0.0])).all()
    quarters, _, _ = np.histogram2d(values[1:, 0], values[1:, 5], bins=(4, 4))
    assert (quarters > 0).all()


def test_questions_that_make_no_sense_are_refused_with_all_that_is_wrong():
    pose, setup = Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), setup_of("ur5 plate")
    for ranges in (
        {"x": (1, -1), "y": (0, math.nan), "z": (0, 1e9), "yaw_deg": (-400, 400)},
        {"yaw": (0, 1), "x": 3, "y": ("a", 2), "z": (1, 2, 3)},
        {}, {"x": (0.5, 0.5)},
    ):  # fmt: skip
        with pytest.raises(PlacementError) as told:
            Region.around(pose, ranges)
        wrong = [name for name in ranges if len(ranges) > 1] or ["nothing varies"]
        assert all(name in str(told.value) for name in wrong)
    empty = plane((0, 1), (0, 1)).cells(0, 3)
    with pytest.raises(PlacementError) as told:
        place(
            setup.robot, empty, setup.task, region_about(pose), Search(method="greedy"), count=0,
            rounds=-1, keep=0, time_limit=0.0,
        )  # fmt: skip
    for words in ("no cells", "greedy", "count", "rounds", "keep", "time_limit"):
        assert words in str(told.value)
