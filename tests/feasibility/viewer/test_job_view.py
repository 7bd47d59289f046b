"""Pictures of paths and divisions: what is drawn is what is done."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from path_cases import path_of
from scipy.spatial import KDTree

from feasibility import check
from feasibility.cases import load_case
from feasibility.division import divide
from feasibility.paths import coverage_path
from feasibility.timing import trajectory
from feasibility.treated import treated_by_walk
from feasibility.viewer import view_division, view_path
from feasibility.viewer.path_and_division import STROKES
from feasibility.viewer.playback import LONGEST
from robots import Kinematics


@cache
def path():
    """Over the paper's first case, row by row."""
    return coverage_path(check(*load_case("paper/4a").build()), "rows")


@cache
def division():
    """Of the paper's cylinder that joint 1 cannot sweep."""
    case = load_case("paper/4d").build()
    return divide(case.robot, case.cells, case.task)


def tracks(view, name):
    """The animation's tracks of one property: path -> keys."""
    (animation,) = [c for c in view.commands if c["type"] == "set_animation"]
    found = {}
    for part in animation["animations"]:
        for keys in part["clip"]["tracks"]:
            if keys["name"] == name:
                found[part["path"]] = keys
    return found


def numbers(packed):
    """A typed array of the page, as numbers."""
    return np.frombuffer(packed.data, dtype="<f4")


def test_the_trail_appears_piece_by_piece_behind_the_tool():
    """Each piece is drawn once, hidden until the tool has passed its end, in the order of time."""
    view = view_path(path(), case="paper/4a")
    appearing = tracks(view, ".visible")
    drawn = [c["path"] for c in view.commands if "painted trail/" in c.get("path", "")]
    assert sorted(appearing) == sorted(drawn)
    assert 0.9 * STROKES <= len(drawn) <= STROKES
    when = np.array([numbers(appearing[name]["times"])[1] for name in sorted(appearing)])
    assert (np.diff(when) > 0.0).all()
    assert when[-1] == pytest.approx(view.motion.seconds[-1], rel=1e-6)
    assert all(keys["values"] == [False, True, True] for keys in appearing.values())
    assert "rows" in view.legend.text
    assert view.legend.title == "paper/4a: feasible, one path over 90 cells"


def test_the_swept_stripe_is_painted_without_gaps():
    """At any time what is shown is what the tool has come by until then, however long its path."""
    one, radius = path(), 0.02
    task = replace(one.task, footprint=2.0 * radius)
    view = view_path(one, treated=treated_by_walk(one.robot, one.cells, task, one.walk))
    when = tracks(view, ".visible")
    drawn = [c for c in view.commands if c.get("path", "").startswith("/treated/")]
    drawn = [c for c in drawn if c["path"] in when]
    corners = [c["object"]["geometries"][0]["data"]["attributes"]["position"] for c in drawn]
    middles = [numbers(part["array"]).reshape(-1, 3, 3).mean(axis=1) for part in corners]
    shown = [numbers(when[c["path"]]["times"])[1] for c in drawn]
    shown = np.repeat(shown, [len(part) for part in middles])
    end = view.motion.seconds[-1]
    for now in (0.2 * end, 0.5 * end, 0.8 * end):
        behind = view.motion.tool_at(np.linspace(0.0, now, 20_000))
        away, _ = KDTree(behind).query(np.concatenate(middles))
        height = task.standoff
        assert (shown[away < np.hypot(0.8 * radius, height)] <= now + 0.01 * end).all()
        assert (shown[away > np.hypot(2.0 * radius, height)] >= now - 0.01 * end).all()
    assert "treated " in view.legend.text


def test_the_arm_plays_the_walk():
    """Every waypoint, in even time."""
    view = view_path(path())
    np.testing.assert_array_equal(view.motion.walk, path().walk.q)
    assert view.motion.seconds[-1] <= LONGEST


def test_the_slider_shows_the_time_of_a_trajectory():
    """Not that of the view, which shows long ones in a minute."""
    few = path_of("4a, coarse")
    run = trajectory(few, 0.05)
    assert run.duration > LONGEST
    drawn = view_path(few, run)
    assert drawn.readout.duration == run.duration
    assert drawn.readout.times[-1] <= LONGEST + 1e-9
    assert view_path(few).readout.duration is None


def test_patches_and_what_is_left_out_are_coloured():
    """60 cells of the one patch, 30 that joint 1 cannot reach; the page needs nothing else."""
    view = view_division(division(), "paper/4d")
    assert view.legend.title == "paper/4d: 60 of 90 cells: 1 patch, 30 left out"
    names = [entry.label for entry in view.legend.entries]
    assert "patch 1 (60 cells)" in names
    assert "not covered: joint limits (30)" in names
    assert "http" not in view.html().split("</head>")[0].replace("http-equiv", "")


def test_moves_between_patches_are_drawn_where_the_tool_goes():
    """Made of two walks by hand: the arm goes straight from one to the other."""
    from feasibility.division import Reconfiguration

    one = division()
    patch = one.fewest.patches[0]
    half = len(patch.walk.q) // 2
    from feasibility.verdict import Walk

    parts = [
        replace(patch, walk=Walk(patch.walk.q[:half], patch.walk.cell[:half])),
        replace(patch, walk=Walk(patch.walk.q[::-1], patch.walk.cell[::-1])),
    ]
    robot = one.robot
    move = Reconfiguration(
        robot.joint_names, robot.prismatic, parts[0].walk.q[-1], parts[1].walk.q[0]
    )
    two = replace(one, fewest=replace(one.fewest, patches=tuple(parts), moves=(move,)))
    view = view_division(two)
    assert any("move from patch 1 to 2" in entry.label for entry in view.legend.entries)
    assert "move 1 to 2" in view.legend.text
    walk = view.motion.walk
    np.testing.assert_array_equal(walk[:half], parts[0].walk.q)
    np.testing.assert_array_equal(walk[-len(parts[1].walk.q) :], parts[1].walk.q)
    between = walk[half - 1 : len(walk) - len(parts[1].walk.q) + 1]
    share = np.linspace(0.0, 1.0, len(between))[:, None]
    np.testing.assert_allclose(between, move.start + share * (move.end - move.start), atol=1e-12)
    kinematics = Kinematics(robot)
    np.testing.assert_allclose(
        view.motion.points[half - 1], kinematics.tool(parts[0].walk.q[-1])[0], atol=1e-12
    )
