"""Placements: found where there are some, refused where a bound shows that there are none."""

from __future__ import annotations

import argparse
import csv
import io
import json
import re
import time
from collections.abc import Sequence
from dataclasses import replace

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from placement_cases import (
    DEAR,
    MOVED,
    TEXTS,
    assert_put_back,
    moved_away,
    placement_case,
    region_about,
    vars_of,
)

from feasibility import Answer, CauseKind, Evidence, Search, check
from feasibility.certification import replay
from feasibility.cli.place import run_place
from feasibility.placement import (
    AXES,
    PlacementMap,
    Placements,
    Pose,
    Region,
    Stage,
    StudyEvaluator,
    Trial,
    moved_cells,
    place,
    station_plan,
    trial_table,
)
from feasibility.placement.evaluator import LocalEvaluator
from feasibility.placement.map import axes_of, placement_map
from feasibility.placement.quick_search import MOST_COVERS, covers_of, search_quickly
from feasibility.placement.reach_bound import Reach
from feasibility.placement.region import PlacementError
from feasibility.placement.stations import fewest_stations
from feasibility.placement.study_tasks import trial_from
from feasibility.reports.placement import as_csv, as_json, as_text, settings_of
from feasibility.roadmap import (
    PROJECTION_STEPS,
    Exploration,
    arrays_of,
    covering_walk,
    project_onto_cell,
)
from feasibility.safe_files import FileError
from feasibility.studies import Store, open_workers
from feasibility.viewer import plot_map
from surfaces import mesh, plane, rotation_from_rpy, sphere
from surfaces.meshes.mesh_surface import TriangleMesh


class Nobody:
    """An evaluator that must not be asked."""

    def try_all(self, poses: Sequence[Pose], early: bool) -> list[Trial]:
        raise AssertionError("no search should be run")

    def check_all(self, poses: Sequence[Pose], causes: bool) -> list[Trial]:
        raise AssertionError("no search should be run")


# -- what the search finds ------------------------------------------------------------------------


@pytest.mark.parametrize("name", TEXTS)
def test_the_cases_are_feasible_as_they_stand(name: str) -> None:
    assert check(*placement_case(name).build()).feasible


@pytest.mark.parametrize(("name", "seed"), [moved for moved in MOVED if moved not in DEAR])
def test_a_surface_moved_away_is_put_back(name: str, seed: int) -> None:
    """Infeasible where it was moved to; in the region around there is a place, and check agrees."""
    assert_put_back(name, seed)


def test_a_region_far_away_is_refused_by_the_bound_alone() -> None:
    for name in TEXTS:
        setup = placement_case(name).build()
        own = Pose.of_surface(setup.cells.surface).values
        far = own + np.array([3.0, 0, 0, 0, 0, 0])
        region = region_about(Pose.of_values(far))
        placements = place(*setup[:3], region, setup.search, evaluator=Nobody())
        assert placements.answer is Answer.INFEASIBLE
        assert placements.evidence is Evidence.PROOF
        assert placements.cause is CauseKind.OUT_OF_REACH
        assert placements.found == ()
        assert placements.statistics["fk"] == 0
        json.dumps(as_json(placements), allow_nan=False)
        assert "proved for the whole region" in placements.message


def test_none_in_a_region_within_reach() -> None:
    """The plate faces the floor below the arm; no bound sees it, and the cause is told."""
    case = placement_case("ur5 plate")
    setup = case.build()
    region = Region.around(
        Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), {"x": (-0.05, 0.05), "y": (-0.05, 0.05)}
    )
    narrow = type(setup.task)(standoff=0.02, cone_deg=5)
    placements = place(setup.robot, setup.cells, narrow, region, count=2, around=0)
    assert placements.answer is Answer.INFEASIBLE
    assert placements.evidence is Evidence.EXHAUSTED
    best = placements.best
    assert best is not None
    assert best.answer is Answer.INFEASIBLE
    verdict = check(setup.robot, moved_cells(setup.cells, best.pose), narrow)
    areas = verdict.cells.areas
    assert placements.share == pytest.approx(areas[verdict.covered].sum() / areas.sum())
    assert sum(placements.causes.values()) == (~verdict.covered).sum()
    assert str(placements.cause) == next(iter(placements.causes))
    assert placements.share < 1.0
    text = as_text(placements)
    assert "none in the region" in text
    assert "no proof" in " ".join(text.split())


def test_the_seed_decides_everything_and_time_running_out_decides_nothing() -> None:
    setup = placement_case("panda plate").build()
    region = region_about(Pose.of_surface(setup.cells.surface))
    ask = {"count": 8, "around": 1, "keep": 1}
    one, two = (place(*setup[:3], region, Search(seed=3), **ask) for _ in range(2))
    assert [trial_table(t) for t in one.trials] == [trial_table(t) for t in two.trials]
    other = place(*setup[:3], region, Search(seed=4), **ask)
    assert [t.pose for t in other.trials] != [t.pose for t in one.trials]
    late = place(*setup[:3], region, time_limit=1e-9)
    assert late.answer is Answer.UNDECIDED
    assert late.found == ()


def test_a_verdict_decides_not_the_search() -> None:
    """Placements that the short search believes in are not an answer until check agrees."""

    class Doubting(LocalEvaluator):
        def check_all(self, poses: Sequence[Pose], causes: bool) -> list[Trial]:
            return [
                Trial(pose, Stage.CHECK, 1.0, answer=Answer.UNDECIDED, evidence=Evidence.BUDGET)
                for pose in poses
            ]

    setup = placement_case("panda plate").build()
    region = region_about(Pose.of_surface(setup.cells.surface))
    placements = place(*setup[:3], region, evaluator=Doubting(*setup), count=8, around=1, keep=2)
    assert any(trial.complete for trial in placements.trials)
    assert placements.answer is Answer.UNDECIDED
    assert placements.found == ()


# -- bounds ---------------------------------------------------------------------------------------


def test_the_bound_on_a_region_holds_for_its_placements() -> None:
    """Against 128 placements in each of 60 regions, some near the edge of reach."""
    proved = several = 0
    setups = [placement_case(name).build() for name in TEXTS]
    reaches = [Reach.of(setup.robot, setup.cells, setup.task) for setup in setups]
    for k in range(60):
        reach = reaches[k % len(reaches)]
        rng = np.random.default_rng([21, k])
        far = rng.normal(size=3)
        far *= rng.uniform(0.8, 1.6) * (reach.reach + 0.3) / np.linalg.norm(far)
        turn = rng.uniform(-180.0, 180.0, 3)
        widths = rng.uniform(0.0, [0.4] * 3 + [40.0] * 3)
        centre = np.concatenate([far, turn])
        ends = zip(AXES, centre - widths, centre + widths, strict=True)
        region = Region.around(Pose.of_values(centre), {n: (a, b) for n, a, b in ends})
        beyond = reach.beyond(region)
        values = np.vstack([region.samples(64, k), corners(region)])
        furthest = reach.distances(values).max(axis=1)
        if beyond is not None:
            assert furthest.min() >= beyond.distance - 1e-9
            assert beyond.distance > reach.reach + reach.tolerance
            proved += 1
            several += beyond.boxes > 1
    assert proved > 20
    assert several > 5
    assert proved < 60


def corners(region: Region) -> np.ndarray:
    """(64, 6) the corners of a region."""
    picks = np.array(np.meshgrid(*[[0, 1]] * 6)).reshape(6, -1).T
    return np.where(picks == 0, region.low, region.high)


def test_distances_are_those_of_the_targets() -> None:
    setup = placement_case("ur5 pipe").build()
    reach = Reach.of(setup.robot, setup.cells, setup.task)
    values = region_about(Pose.of_surface(setup.cells.surface)).samples(8, 1)
    origin = setup.robot.model.jointPlacements[1].translation
    for row, found in zip(values, reach.distances(values), strict=True):
        cells = moved_cells(setup.cells, Pose.of_values(row))
        targets = setup.task.targets(cells).points
        assert found == pytest.approx(np.linalg.norm(targets - origin, axis=1), abs=1e-12)
        assert reach.slack(row) == pytest.approx(1.0 - found.max() / setup.robot.reach)


def test_what_the_bound_discards_is_proved_infeasible() -> None:
    setup = placement_case("ur5 plate").build()
    placer = LocalEvaluator(*setup)
    region = Region.around(Pose.of_surface(setup.cells.surface), {"x": (0.5, 1.4), "z": (0, 0.5)})
    discarded = 0
    for row in region.samples(16, 0):
        trial = placer.try_at(Pose.of_values(row))
        if trial.stage is Stage.BOUND:
            assert trial.fk == 0
            assert trial.in_reach < 1.0
            verdict = check(setup.robot, moved_cells(setup.cells, trial.pose), setup.task)
            assert verdict.answer is Answer.INFEASIBLE
            assert verdict.evidence is Evidence.PROOF
            areas = verdict.cells.areas
            assert areas[verdict.covered].sum() <= trial.in_reach * areas.sum() + 1e-12
            discarded += 1
    assert 3 < discarded < 17


# -- one placement --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*TEXTS, "mesh"])
def test_a_moved_problem_is_the_problem_of_the_moved_surface(name: str) -> None:
    setup = placement_case("ur5 plate" if name == "mesh" else name).build()
    cells = bent_mesh() if name == "mesh" else setup.cells
    placer = LocalEvaluator(setup.robot, cells, setup.task, setup.search)
    for seed in range(3):
        pose = moved_away(placement_case("ur5 plate"), seed)
        one = placer.problem_at(pose)
        two = arrays_of(setup.robot, moved_cells(cells, pose), setup.task)
        for field in (
            "points",
            "approaches",
            "first_piece",
            "derivative_bounds",
            "deviations",
            "curvature",
            "near",
        ):
            assert getattr(one, field) == pytest.approx(getattr(two, field), abs=1e-7), field
        assert one.targets == pytest.approx(two.targets, abs=1e-7)
        # Of the same types, so that no kernel has to be compiled for it anew.
        assert [numba.typeof(field) for field in one] == [numba.typeof(field) for field in two]


def bent_mesh():
    """Cells of a roof of many triangles."""
    x, y = (
        axis.ravel() for axis in np.meshgrid(np.linspace(-0.2, 0.2, 13), np.linspace(0, 0.3, 9))
    )
    vertices = np.column_stack([x, y, 0.1 * x**2 + 0.05 * y**2])
    k = np.arange(9 * 13).reshape(9, 13)
    a, b, c, d = k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]
    faces = np.vstack([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return mesh(TriangleMesh(vertices, faces), position=(0.5, 0, 0.1)).cells(count=8)


@pytest.mark.parametrize("name", TEXTS)
def test_moved_cells_are_those_of_the_case_to_the_last_bit(name: str) -> None:
    case = placement_case(name)
    cells = case.build().cells
    for seed in range(3):
        pose = moved_away(case, seed)
        built = case.with_overrides(settings_of(pose)).build().cells
        moved = moved_cells(cells, pose)
        for field in ("centres", "normals", "areas"):
            assert (getattr(moved, field) == getattr(built, field)).all()
        assert (moved.curves.cubics == built.curves.cubics).all()


def test_moving_a_mesh_is_rigid() -> None:
    cells = bent_mesh()
    pose = Pose((0.1, -0.2, 0.3), (10.0, -70.0, 130.0))
    moved = moved_cells(cells, pose)
    assert (moved.labels == cells.labels).all()
    turn = pose.rotation @ cells.surface.rotation.T
    closest_point = moved.surface.closest(moved.centres)
    assert np.abs(closest_point.height).max() < 1e-9
    assert moved.normals == pytest.approx(cells.normals @ turn.T, abs=1e-12)
    assert (moved.locate(moved.centres) == np.arange(len(cells))).all()


def test_the_margin_can_be_kept_over_every_cell() -> None:
    """With limits and cone drawn in by its shares, every cell still has a configuration."""
    margin_shares = 0
    for name in TEXTS:
        setup = placement_case(name).build()
        placer = LocalEvaluator(*setup)
        pose = Pose.of_surface(setup.cells.surface)
        trial = placer.try_at(pose)
        assert trial.complete, name
        limits, cone, _ = vars_of(trial)
        margin_shares += min(limits, cone) > 0.05
        exploration = Exploration(setup.robot, setup.cells, placer.problem_at(pose), 1)
        problem = exploration.arrays
        half = 0.5 * (problem.upper - problem.lower)
        bounded = np.isfinite(half)
        inwards = np.where(bounded, (limits - 1e-3) * half, 0.0)
        cone_chord = (1.0 - cone + 1e-3) * problem.cone_chord
        drawn_in = problem._replace(
            lower=problem.lower + inwards,
            upper=problem.upper - inwards,
            cone_chord=cone_chord,
            inner_cone_chord=cone_chord,
        )
        for cell in range(len(setup.cells)):
            guesses = np.clip(exploration.guesses(400), drawn_in.lower, drawn_in.upper)
            assert any(
                project_onto_cell(drawn_in, exploration.work, cell, q, PROJECTION_STEPS)
                for q in guesses
            )
    assert margin_shares >= 4


def test_what_a_short_search_covers_is_one_motion() -> None:
    """Every component of an infeasible placement is replayed over the moved cells."""
    several = 0
    for name, seed in MOVED[::2]:
        case = placement_case(name)
        setup = case.build()
        placer, pose = LocalEvaluator(*setup), moved_away(case, seed)
        exploration = Exploration(setup.robot, setup.cells, placer.problem_at(pose), 0)
        search_quickly(exploration, False)
        covers = covers_of(exploration)
        assert 0 < len(covers) <= MOST_COVERS
        roots = {
            exploration.roadmap.cover[r].astype(bool).tobytes(): r for r in exploration.roots()
        }
        cells = moved_cells(setup.cells, pose)
        for cover in covers:
            walk = covering_walk(exploration.roadmap, roots[cover.tobytes()])
            assert replay(setup.robot, cells, setup.task, walk, cover).accepted
        several += len(covers) > 1
    assert several > 0


def test_trials_survive_their_journey() -> None:
    """As JSON, with the result of a search and of a verdict."""
    setup = placement_case("panda plate").build()
    placer = LocalEvaluator(*setup)
    case = placement_case("panda plate")
    poses = [Pose.of_surface(setup.cells.surface), moved_away(case, 3), Pose.of_values([9.0] * 6)]
    trials = [placer.try_at(pose) for pose in poses]
    trials += [placer.check_at(pose, causes=True) for pose in poses[:2]]
    stages = [trial.stage for trial in trials]
    assert {Stage.BOUND, Stage.SEARCH, Stage.CHECK} <= set(stages)
    for trial in trials:
        table = json.loads(json.dumps(trial_table(trial), allow_nan=False))
        again = trial_from(table)
        assert trial_table(again) == table
        assert (again.covers == trial.covers).all()
        assert again.rank == trial.rank
        assert again.feasible == trial.feasible
    assert trials[3].feasible
    assert not trials[4].feasible
    assert sum(trials[4].causes.values()) == len(setup.cells) - trials[4].covers[0].sum()


# -- workers and stores ---------------------------------------------------------------------------


def test_who_tries_placements_changes_nothing_and_a_store_saves_the_work(tmp_path) -> None:
    case = placement_case("ur5 plate")
    setup = case.build()
    region = region_about(moved_away(case, 3))
    ask = {"count": 8, "around": 1, "keep": 1}
    here = place(*setup[:3], region, setup.search, **ask)
    expected = [trial_table(trial) for trial in here.trials]
    with open_workers(1) as workers:
        evaluator = StudyEvaluator(case, workers)
        spread = place(*setup[:3], region, setup.search, evaluator=evaluator, **ask)
    assert [trial_table(trial) for trial in spread.trials] == expected
    path = tmp_path / "placements.db"
    counts = []
    for _ in range(2):
        with open_workers(0) as workers, Store(path) as store:
            evaluator = StudyEvaluator(case, workers, store)
            kept = place(*setup[:3], region, setup.search, evaluator=evaluator, **ask)
            counts.append(len(store))
        assert [trial_table(trial) for trial in kept.trials] == expected
    assert counts[0] == counts[1] > 8
    with Store(path) as store, open_workers(0) as workers:
        evaluator = StudyEvaluator(case, Refusing(workers), store)
        again = place(*setup[:3], region, setup.search, evaluator=evaluator, **ask)
    assert [trial_table(trial) for trial in again.trials] == expected


class Refusing:
    """Workers that take nothing."""

    def __init__(self, workers) -> None:
        self.breaks, self.deaths = workers.breaks, workers.deaths
        self.patience, self.width, self.broken = workers.patience, workers.width, workers.broken

    def submit(self, *arguments: object) -> None:
        raise AssertionError("everything is in the store")


def test_a_placement_that_nobody_can_try_is_no_answer() -> None:
    """A broken case fails in its worker; the search says so and stays undecided."""
    case = placement_case("ur5 plate")
    setup = case.build()
    with open_workers(0) as workers:
        evaluator = StudyEvaluator(case, workers)
        evaluator.tables = {**evaluator.tables, "robot": {"name": "no such arm"}}
        region = region_about(Pose.of_surface(setup.cells.surface))
        placements = place(*setup[:3], region, evaluator=evaluator, count=4, around=1)
    assert placements.answer is Answer.UNDECIDED
    assert "could not be tried" in placements.message
    assert all(trial.stage is Stage.FAILED for trial in placements.trials)


# -- regions --------------------------------------------------------------------------------------

ANGLES = st.floats(-180.0, 180.0)


@settings(max_examples=100)
@given(ANGLES, st.one_of(st.floats(-90.0, 90.0), st.sampled_from([-90.0, 90.0])), ANGLES)
def test_a_surface_says_where_it_stands(roll: float, pitch: float, yaw: float) -> None:
    surface = plane((0, 1), (0, 1), position=(1, 2, 3), rpy_deg=(roll, pitch, yaw))
    pose = Pose.of_surface(surface)
    assert pose.position == (1.0, 2.0, 3.0)
    assert pose.rotation == pytest.approx(surface.rotation, abs=1e-7)
    assert rotation_from_rpy(*np.radians(pose.rpy_deg)) == pytest.approx(pose.rotation)


def test_samples_lie_in_the_region_and_fill_it() -> None:
    held = Pose((0.1, 0.2, 0.3), (0.0, 0.0, 0.0))
    region = Region.around(held, {"x": (-1 / 3, 1 / 3), "yaw_deg": (-0.0000004, 90)})
    values = region.samples(64, 5)
    assert len(values) >= 64
    assert all(region.holds(Pose.of_values(row), 0.0) for row in values)
    assert (values[:, [1, 2, 3, 4]] == np.array([0.2, 0.3, 0.0, 0.0])).all()
    quarters, _, _ = np.histogram2d(values[1:, 0], values[1:, 5], bins=(4, 4))
    assert (quarters > 0).all()
    near = region.near(values[3], 0.1, 16, 0)
    assert all(region.holds(Pose.of_values(row), 0.0) for row in near)
    assert np.ptp(near[:, 0]) <= 0.1 * 2 / 3 + 2e-6
    assert np.abs(near[:, 0] - values[3, 0]).max() <= 0.1 * 2 / 3 + 2e-6


def test_all_faults_of_a_region_are_told_together() -> None:
    pose = Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    with pytest.raises(PlacementError) as told:
        Region.around(pose, {"x": (1, -1), "y": (0, np.nan), "z": (0, 1e9), "yaw_deg": (-400, 400)})
    for words in ("x: 1 .. -1 is empty", "y: 0 .. nan", "z: ", "yaw_deg: ", "360 degrees wide"):
        assert words in str(told.value)
    with pytest.raises(PlacementError) as told:
        Region.around(pose, {"yaw": (0, 1), "x": 3, "y": ("a", 2), "z": (1, 2, 3)})
    for words in ("yaw: is not known", "yaw_deg", "x: expected two numbers", "y: ", "z: "):
        assert words in str(told.value)
    for nothing in ({}, {"x": (0.5, 0.5)}):
        with pytest.raises(PlacementError, match="nothing varies"):
            Region.around(pose, nothing)


def test_questions_that_make_no_sense() -> None:
    setup = placement_case("ur5 plate").build()
    region = region_about(Pose.of_surface(setup.cells.surface))
    empty = plane((0, 1), (0, 1)).cells(0, 3)
    with pytest.raises(PlacementError) as told:
        place(
            setup.robot, empty, setup.task, region, Search(method="greedy"), count=0, around=-1,
            keep=0, time_limit=0.0,
        )  # fmt: skip
    for words in ("no cells", "greedy", "count", "around", "keep", "time_limit"):
        assert words in str(told.value)


# -- maps, reports, the command -------------------------------------------------------------------


def small_map() -> tuple[Placements, PlacementMap, LocalEvaluator]:
    setup = placement_case("panda plate").build()
    own = Pose.of_surface(setup.cells.surface)
    region = Region.around(own, {"x": (0.3, 1.2), "y": (-0.3, 0.3), "yaw_deg": (-40, 40)})
    evaluator = LocalEvaluator(*setup)
    placements = place(*setup[:3], region, evaluator=evaluator, count=8, around=1, keep=1)
    assert placements.best is not None
    chart = placement_map(evaluator, region, placements.best.pose, shape=(3, 2, 2))
    return placements, chart, evaluator


def test_a_map_tells_what_single_placements_tell() -> None:
    placements, chart, evaluator = small_map()
    assert chart.axes == ("x", "y", "yaw_deg") == axes_of(placements.region)
    assert chart.share.shape == chart.margin.shape == (3, 2, 2)
    for index in np.ndindex(3, 2, 2):
        values = chart.held.values
        for axis, ticks, k in zip(chart.axes, chart.ticks, index, strict=True):
            values[AXES.index(axis)] = ticks[k]
        trial = evaluator.try_at(Pose.of_values(values), early=False)
        assert chart.share[index] == trial.share
        assert chart.margin[index] == trial.margin
    assert chart.share.max() == 1.0 > chart.share.min()
    for value in ("share", "margin"):
        figure = plot_map(chart, placements, value)
        panels = [axes for axes in figure.axes if axes.get_title()]
        assert len(panels) == 2
        assert figure._repr_png_().startswith(b"\x89PNG")
        stars = [line for axes in panels for line in axes.lines if line.get_marker() == "*"]
        assert len(stars) == 1
        where = [float(stars[0].get_xdata()[0]), float(stars[0].get_ydata()[0])]
        assert placements.best is not None
        assert where == list(placements.best.pose.position[:2])
        drawn = [axes.collections[0].get_array() for axes in panels]
        for k, field in enumerate(drawn):
            assert (getattr(chart, value)[:, :, k] == np.asarray(field).reshape(2, 3).T).all()
    with pytest.raises(PlacementError, match="z: does not vary"):
        placement_map(evaluator, placements.region, chart.held, axes=("x", "z"))
    report = json.loads(json.dumps(as_json(placements, chart=chart), allow_nan=False))
    assert report["map"]["share"][0][0][0] == chart.share[0, 0, 0]


def test_the_table_of_all_placements() -> None:
    setup = placement_case("panda plate").build()
    region = Region.around(Pose.of_surface(setup.cells.surface), {"x": (0.4, 1.2)})
    placements = place(*setup[:3], region, count=16, around=1, keep=1)
    rows = list(csv.DictReader(io.StringIO(as_csv(placements))))
    assert len(rows) == len(placements.trials)
    columns = ("x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg")
    for row, trial in zip(rows, placements.trials, strict=True):
        assert [float(row[column]) for column in columns] == trial.pose.values.tolist()
        assert float(row["share"]) == trial.share
        assert row["stage"] == str(trial.stage)
    shares = [float(row["share"]) for row in rows]
    assert shares == sorted(shares, reverse=True)


def test_every_column_for_people_has_its_unit() -> None:
    setup = placement_case("panda plate").build()
    region = Region.around(Pose.of_surface(setup.cells.surface), {"x": (0.4, 1.2)})
    placements = place(*setup[:3], region, count=8, around=0, keep=1)
    head = next(line for line in as_text(placements).splitlines() if " (m)" in line)
    assert head.split("  ")[-1] == "reach (0..1)"
    columns = re.findall(r"(\w+) \(([^)]+)\)", head)
    assert columns[:7] == [
        *((name, "m") for name in "xyz"),
        *((name, "deg") for name in ("roll", "pitch", "yaw")),
        ("share", "%"),
    ]
    assert {unit for _, unit in columns[7:]} == {"0..1"}
    assert re.sub(r"\w+ \([^)]+\)", "", head).strip() == ""


def test_progress_estimates_the_end() -> None:
    """The number expected never falls below what is done, and comes near to what is tried."""
    setup = placement_case("panda plate").build()
    region = Region.around(Pose.of_surface(setup.cells.surface), {"x": (0.4, 1.2)})
    seen = []
    place(
        *setup[:3], region, count=200, around=2, keep=1,
        progress=lambda done, total, text: seen.append((done, total, text)),
    )  # fmt: skip
    trying = [(done, total) for done, total, text in seen if text.startswith("trying")]
    assert len(trying) > 3
    assert all(done <= total for done, total in trying)
    assert trying[0][1] <= 2 * trying[-1][0]


def test_stations_where_no_single_placement_will_do() -> None:
    """A sphere's shell around the tool is too much at once, but not from several placements."""
    setup = placement_case("ur5 plate").build()
    shell = sphere(0.35, polar_deg=(20, 160), azimuth_deg=(0, 360), side="outside").cells(3, 6)
    region = Region.around(
        Pose((0.6, 0.0, 0.3), (0.0, 0.0, 0.0)),
        {"x": (0.5, 0.9), "z": (0.2, 0.5), "yaw_deg": (-180, 180)},
    )
    placements = place(setup.robot, shell, setup.task, region, count=8, around=0)
    assert placements.answer is Answer.INFEASIBLE
    evaluator = LocalEvaluator(setup.robot, shell, setup.task, Search())
    plan = station_plan(placements, evaluator, count=8)
    stations = plan.stations
    assert stations.optimal
    assert len(stations) >= 2
    assert plan.refusals == ("",) * len(stations)
    covered = sum(len(station.cells) for station in stations.stations)
    assert covered + len(stations.left_out) == len(shell)
    for trial, station in zip(plan.trials, stations.stations, strict=True):
        assert (trial.covers[station.component] == station.covers).all()
    checked = next(trial for trial in placements.trials if trial.stage is Stage.CHECK)
    assert evaluator.replayed(checked, 0) == ""
    lying = Trial(checked.pose, Stage.SEARCH, 1.0, covers=np.ones((1, len(shell)), dtype=bool))
    assert "did not find" in evaluator.replayed(lying, 0)
    # From any table of motions, no fewer.
    fewer = fewest_stations([trial.covers for trial in placements.trials], len(shell))
    assert len(fewer.left_out) >= len(stations.left_out)
    text = as_text(placements, "", plan)
    assert f"{len(stations)} stations" in text
    assert "not certified" not in text
    refused = replace(plan, refusals=("because", *plan.refusals[1:]))
    assert "(not certified: because)" in as_text(placements, "", refused)
    told = as_json(placements, plan)["stations"]
    assert told["at_least"] == len(stations) == len(told["stations"])
    assert all(station["certified"] for station in told["stations"])


def arguments(**given: object) -> argparse.Namespace:
    plain = dict.fromkeys(
        ("x", "y", "z", "roll", "pitch", "yaw", "csv", "map", "out", "html", "dask")
    )
    settings = ["surface.cells=[3,3]"]
    return argparse.Namespace(
        **{**plain, "case": "paper/4a", "settings": settings, "count": 4, "workers": 0,
           "command": "place", "json": False, "stations": False, "time_limit": None, **given}
    )  # fmt: skip


def test_the_command_answers_and_writes(tmp_path, capsys) -> None:
    files = {"csv": tmp_path / "all.csv", "map": tmp_path / "map.svg", "out": tmp_path / "run.db"}
    paths = {name: str(path) for name, path in files.items()}
    assert run_place(arguments(yaw=[-10, 10], json=True, **paths), time.perf_counter()) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["answer"] == "feasible"
    assert answer["placements"][0]["verdict"] == "feasible"
    assert -10 <= answer["placements"][0]["rpy_deg"][2] <= 10
    assert answer["map"]["axes"][0] == "yaw_deg"
    assert "<svg" in files["map"].read_text("utf-8")
    assert files["csv"].read_text("utf-8").startswith("x_m,y_m,z_m,roll_deg")
    assert run_place(arguments(x=[3.0, 3.4], stations=True), time.perf_counter()) == 1
    assert "proved for the whole region" in " ".join(capsys.readouterr().out.split())


def test_the_command_refuses_before_it_searches(tmp_path) -> None:
    with pytest.raises(PlacementError, match="nothing varies"):
        run_place(arguments(), 0.0)
    with pytest.raises(PlacementError, match=r"x: 1 \.\. 0 is empty"):
        run_place(arguments(x=[1.0, 0.0]), 0.0)
    same = str(tmp_path / "map.png")
    with pytest.raises(FileError, match="is also the file of --csv"):
        run_place(arguments(x=[0.0, 1.0], map=same, csv=same), 0.0)
