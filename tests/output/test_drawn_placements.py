"""Pictures of poses: each that was tried is drawn where it was, in the colour of its share."""

from dataclasses import replace

import numpy as np
import pytest
from page_outline import points_of
from scipy.spatial.transform import Rotation
from specimens import SMOOTH, flat

import coverable
from coverable import Answer, Evidence, Pose, load_robot, plane, view_placements
from feasibility.placement.stations import StationPlan
from feasibility.placement.trials import Trial
from feasibility.studies.store import Row
from feasibility.studies.stored import bits_of
from feasibility.viewer import pose_outlines as pose_layers
from feasibility.viewer.pose_outlines import Class, Tried, class_of_row, class_of_share, outline
from feasibility.viewer.threejs import hex_colour

PLATE = plane((-0.15, 0.15), (-0.1, 0.1), position=(0.5, 0, 0.2), side="outside")
CELLS = PLATE.cells(3, 2)
TASK = coverable.Task(standoff=0.02, cone_deg=30)
UR5 = load_robot("ur5")


def poses(count, seed=0):
    rng = np.random.default_rng(seed)
    low, high = [0.3, -0.4, 0.1, -40, -40, -90], [0.8, 0.4, 0.5, 40, 40, 90]
    return [Pose.of_values(row) for row in rng.uniform(low, high, (count, 6)).round(6)]


def tried(pose, share, covered=True):
    """A trial that nobody called feasible, with one component over so many of the six cells."""
    cells = [bits_of(np.arange(6) < round(6 * share))] if covered else []
    return Trial(pose, {"message": "", "share": share, "cells": 6, "components": cells})


def fabricated():
    """A search without an answer whose trials fall into every class but 'feasible'."""
    at = iter(poses(40))
    shares = 1.0, 1.0, 5 / 6, 0.75, 2 / 3, 0.6, 0.5, *[1 / 3] * 4
    trials = [
        *(tried(next(at), share) for share in shares),
        *(tried(next(at), share, False) for share in (1 / 6, 0.0, 0.0, 0.0, 0.0)),
        *(Trial(next(at), {"message": "no"}) for _ in range(3)),
    ]
    region = coverable.Region.around(Pose.of_surface(PLATE), {"x": (0.2, 0.9)})
    return coverable.Placements(
        UR5, CELLS, TASK, region, Answer.INFEASIBLE, Evidence.EXHAUSTED, "", (), tuple(trials),
        None, statistics={"bound": 11},
    )  # fmt: skip


EXPECTED = {
    Class.WHOLE: 2, Class.MOST: 2, Class.HALF: 3, Class.SOME: 4, Class.LITTLE: 5, Class.FAILED: 3,
}  # fmt: skip


def turned(points, pose):
    """Points of the surface's frame at a pose, by scipy's fixed-axis angles."""
    turn = Rotation.from_euler("xyz", pose.rpy_deg, degrees=True)
    return turn.apply(np.reshape(points, (-1, 3))) + pose.position


def test_every_class_is_in_the_legend_and_every_pose_a_dot_where_the_surface_was_tried():
    """The middle of the outline, against scipy's rotations; hundreds of them are one object."""
    asked = fabricated()
    lines = outline(CELLS)
    middle = (lines.min(axis=(0, 1)) + lines.max(axis=(0, 1))) / 2
    for times in (1, 30):
        view = view_placements(replace(asked, trials=asked.trials * times))
        drawn = {c["path"]: c for c in view.commands if c["type"] == "set_object"}
        classes = (e for e in view.legend.entries if (e.path or "").startswith("/poses/"))
        entries = {entry.label: entry for entry in classes}
        assert list(entries) == [f"{kind} ({number * times})" for kind, number in EXPECTED.items()]
        kinds = [pose_layers.class_of_trial(trial) for trial in asked.trials]
        for kind, entry in zip(EXPECTED, entries.values(), strict=True):
            (material,) = drawn[entry.path]["object"]["materials"]
            assert material["color"] == hex_colour(entry.colour)
            assert not entry.shown, "dots are off at first"
            poses = [t.pose for t, k in zip(asked.trials, kinds, strict=True) if k is kind] * times
            got = points_of(drawn[entry.path]).reshape(len(poses), 6, 3)
            want = np.concatenate([turned(middle, pose) for pose in poses])
            np.testing.assert_allclose(got.mean(axis=1), want, atol=2e-5)
            assert np.ptp(got, axis=1).max() < 0.05


def test_whole_shares_are_feasible_only_where_that_was_said():
    """A row that failed has no share; one that ran out of time keeps the share it found."""
    for least, below, kind in (
        (1 - 1e-12, 1.0, Class.WHOLE), (0.75, 0.999, Class.MOST), (0.5, 0.7499, Class.HALF),
        (0.25, 0.4999, Class.SOME), (0.0, 0.2499, Class.LITTLE),
    ):  # fmt: skip
        assert class_of_share(least) is class_of_share(below) is kind
    for status, result, kind in (
        ("done", {"verdict": "feasible", "share": 1.0}, Class.FEASIBLE),
        ("done", {"verdict": "undecided", "share": 1.0}, Class.WHOLE),
        ("done", {"verdict": "undecided", "share": 0.6}, Class.HALF),
        ("failed", {"verdict": "undecided", "evidence": "budget", "message": "died"}, Class.FAILED),
    ):
        assert class_of_row(Row({}, status, result, 0.1)) is kind
    with pytest.raises(ValueError, match="a row for each task, got 0 for 0 tasks"):
        coverable.view_study([], [])


@pytest.mark.parametrize(("cells", "length", "strokes"), [
    (flat("sheet", 60).cells(count=6), 2.8, 1), (SMOOTH["ball"].cells(12, 24), 3.6 * np.pi, 0),
])  # fmt: skip
def test_an_outline_is_the_rim_or_three_sections_of_a_closed_surface(cells, length, strokes):
    """In few segments; a stroke points to the working side, where there is one."""
    lines, surface = outline(cells), cells.surface
    count = len(lines) - strokes
    sides = np.linalg.norm(lines[:count, 1] - lines[:count, 0], axis=1)
    assert (count <= 96, sides.sum()) == (True, pytest.approx(length, 0.02))
    heights = surface.closest(lines[:, 1] @ surface.rotation.T + surface.position).height
    assert np.abs(heights[:count]).max() < 0.01
    assert (heights[count:] * surface.side_sign > 0.03).all()


def test_of_many_feasible_poses_some_are_drawn_evenly_and_the_legend_says_so():
    many = [Tried(pose, Class.FEASIBLE, None) for pose in poses(450)]
    (layer,) = pose_layers.class_layers(outline(CELLS), many)
    assert (layer.entry.label, layer.entry.shown) == ("feasible (200 of 450 drawn)", True)
    drawn = points_of(layer.commands[0]).reshape(200, 1, -1, 3).mean(axis=2)
    which = np.linalg.norm(drawn - [one.pose.position for one in many], axis=2).argmin(axis=1)
    assert (which[0], which[-1], {*np.diff(which)}) == (0, 449, {2, 3})


def test_stations_stand_where_they_are_planned_and_what_the_best_one_covers_is_filled():
    asked = replace(fabricated(), trials=fabricated().trials[2:])
    best, one, other, *_ = asked.trials
    plan = StationPlan((one, other), np.array([0, 0, 0, 1, -1, 1]), 2, ("", ""))
    nowhere, view = view_placements(replace(asked, trials=())), view_placements(asked, plan=plan)
    assert nowhere.legend.text.endswith("the surface is drawn at its pose in the case")
    assert view.legend.text.endswith("; 2 stations cover 5 of 6 cells")
    drawn = {c["path"]: points_of(c) for c in view.commands if c["type"] == "set_object"}
    entries = {entry.label: entry for entry in view.legend.entries}
    for label, trial, own in (
        ("station 1 (3 cells)", one, [0, 1, 2]), ("station 2 (2 cells)", other, [3, 5]),
        ("covered there in one motion (5 cells)", best, [0, 1, 2, 3, 4]),
        ("not covered there (1 cell)", best, [5]),
    ):  # fmt: skip
        path, station = entries[label].path, entries[label].shown
        assert station == (trial is not best), "the best one would lie among them"
        corners = drawn[path + "/cells" * station].reshape(len(own), -1, 3)
        centres = turned(CELLS.centres[own] - PLATE.position, trial.pose)
        np.testing.assert_allclose(corners.mean(axis=1), centres, atol=2e-5)
        if station:
            rim = turned(outline(CELLS), trial.pose)
            np.testing.assert_allclose(drawn[f"{path}/outline"], rim, atol=2e-5)
