"""Pictures of what can collide: scene, tool, convex bodies, the nearest pair, blocked cells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fabricated import DOME, TASK, verdict_on

from feasibility import CauseKind
from feasibility.collisions import UNCHECKED, Collision, Obstacle, ToolShape
from feasibility.verdict import Cause
from feasibility.viewer import plot_causes, view
from feasibility.viewer.painter import painted
from feasibility.viewer.threejs import numbers_of
from robots import load_robot

PUMA = load_robot("puma560", limits="set-1")
SCENE = (
    Obstacle.box("shelf", (0.4, 0.3, 0.02), (0.3, -0.6, 0.5), (0.0, 0.0, 30.0)),
    Obstacle.halfspace("wall", (0.0, -1.3, 0.0), (-90.0, 0.0, 0.0)),
    Obstacle.capsule("pipe", 0.05, 0.4, (-0.8, 0.0, 0.2)),
)
ASKED = Collision(surface=False, scene=SCENE, tool=(ToolShape.sphere(0.01, (0.0, 0.0, -0.02)),))


@pytest.fixture(scope="module")
def verdict():
    made = verdict_on(PUMA, DOME.cells(3, 3), witness=True)
    return replace(made, task=replace(TASK, collision=ASKED))


@pytest.fixture(scope="module")
def drawn(verdict):
    return view(verdict, play=False, at=0.5)


def objects(drawn):
    return {c["path"]: c["object"] for c in drawn.commands if c["type"] == "set_object"}


def points_at(drawn, path):
    attributes = objects(drawn)[path]["geometries"][0]["data"]["attributes"]
    return numbers_of(attributes["position"]).reshape(-1, 3)


def only(items):
    (item,) = items
    return item


def entry(drawn, label):
    return only(e for e in drawn.legend.entries if e.label == label)


def test_objects_of_the_scene_stand_where_they_are(drawn):
    shelf, wall, pipe = (points_at(drawn, f"{entry(drawn, one.name).path}/body") for one in SCENE)
    own = (shelf - SCENE[0].placement[:3, 3]) @ SCENE[0].placement[:3, :3]
    np.testing.assert_allclose(np.abs(own), np.tile([0.2, 0.15, 0.01], (len(own), 1)), atol=2e-5)
    np.testing.assert_allclose(wall[:, 1], -1.3, atol=2e-5)
    assert np.ptp(wall[:, 0]) > PUMA.reach, "a plane wider than the arm"
    axis = np.clip(pipe[:, 2], 0.0, 0.4)
    away = np.linalg.norm(pipe - np.column_stack([-0.8 + 0 * axis, 0 * axis, axis]), axis=1)
    np.testing.assert_allclose(away, 0.05, atol=2e-4)
    assert drawn.legend.checked != UNCHECKED


def test_convex_bodies_move_with_the_arm_and_are_off_at_first(drawn):
    hulls = only(e for e in drawn.legend.entries if e.label.startswith("convex bodies"))
    assert not hulls.shown
    paths = [path for path in objects(drawn) if path.startswith("/hulls")]
    assert hulls.label.endswith(f"({len(paths)})")
    assert not any(one.name in path for path in paths for one in SCENE)
    posed = {c["path"]: c["matrix"] for c in drawn.commands if c["type"] == "set_transform"}
    joints = [path for path in posed if path.startswith("/robot")]
    assert len(joints) == PUMA.n
    for path in joints:
        assert posed[path] == posed[path.replace("/robot", "/hulls", 1)]
    with_them = painted(
        [c for c in drawn.commands if c.get("path") != "/hulls"], drawn.camera, 200, 150
    )
    assert np.abs(with_them - drawn.image(200, 150)).max() > 0.05


def test_the_mounted_tool_hangs_on_the_last_joint(drawn):
    path = entry(drawn, "mounted tool").path
    assert path.count("/joint ") == PUMA.n
    assert np.ptp(points_at(drawn, f"{path}/0"), axis=0) == pytest.approx([0.02] * 3, abs=1e-4)


def test_the_nearest_pair_has_its_line_and_its_distance(drawn):
    *_, (name, unit, values) = drawn.readout.rows
    assert (name, unit, len(values)) == ("clearance", "mm", len(drawn.readout.times))
    assert len(drawn.readout.nearest) == len(values)
    times = np.array(drawn.readout.times)
    frame = int(np.searchsorted(times, drawn.start, side="right")) - 1
    shown = only(
        c["path"]
        for c in drawn.commands
        if c.get("property") == "visible" and "/nearest pair/" in c["path"] and c["value"]
    )
    assert shown.endswith(drawn.readout.nearest[frame])
    placed = {c["path"]: np.reshape(c["matrix"], (4, 4)).T for c in drawn.commands
              if c["type"] == "set_transform"}  # fmt: skip
    first, second = (placed[f"{shown}/{end}"][:3, 3] for end in ("first", "second"))
    line = placed[f"{shown}/line"]
    np.testing.assert_allclose(line @ [0.0, 0.0, 0.0, 1.0], [*first, 1.0], atol=1e-9)
    np.testing.assert_allclose(line @ [0.0, 0.0, 1.0, 1.0], [*second, 1.0], atol=1e-9)
    between = np.interp(drawn.start, times, values)
    assert 1e3 * np.linalg.norm(second - first) == pytest.approx(between, abs=5.0)
    assert "nearest: " in drawn.html()


def test_every_pair_is_shown_while_it_is_the_nearest(drawn):
    clips = only(c for c in drawn.commands if c["type"] == "set_animation")["animations"]
    tracks = [(c["path"], only(c["clip"]["tracks"])) for c in clips]
    visible = {path: track["values"] for path, track in tracks if track["name"] == ".visible"}
    assert set(drawn.readout.nearest) == {path.split(" ", 2)[2] for path in visible}
    for path, values in visible.items():
        assert values == [path.endswith(f" {name}") for name in drawn.readout.nearest]
    commands = list(drawn.commands)
    moved = next(k for k, c in enumerate(commands) if c["type"] == "set_animation")
    assert not any(c["type"] == "set_object" for c in commands[moved:]), "or they stand still"


def test_without_collisions_nothing_of_it_is_drawn(verdict):
    plain = view(replace(verdict, task=TASK), play=False)
    assert plain.readout.nearest == ()
    assert "clearance" not in [name for name, _, _ in plain.readout.rows]
    assert not any(path.startswith(("/scene", "/hulls", "/nearest")) for path in objects(plain))


def test_many_objects_share_one_switch(verdict):
    balls = tuple(Obstacle.sphere(f"ball {k}", 0.02, (2.0, 0.1 * k, 0.0)) for k in range(20))
    task = replace(TASK, collision=replace(ASKED, scene=balls))
    drawn = view(replace(verdict, task=task, witness=None, tree=None))
    assert entry(drawn, "scene (20 objects)").path == "/scene"
    assert (
        sum(path.startswith("/scene/") and path.endswith("/body") for path in objects(drawn)) == 20
    )


def test_missed_cells_have_the_colour_of_the_pair_in_the_way():
    pairs = {1: ("forearm", "shelf"), 2: ("forearm", "shelf"), 5: ("link6", "wall")}
    causes = tuple(
        Cause(k, CauseKind.COLLISION, False, "made up", pair) for k, pair in pairs.items()
    )
    causes += (Cause(7, CauseKind.DISCONNECTED, False, "made up", ("forearm", "shelf")),)
    missed = verdict_on(PUMA, DOME.cells(3, 3), missed={1, 2, 5, 7, 8}, causes=causes)
    drawn = view(missed)
    two = entry(drawn, "not covered: collision: forearm and shelf (2 cells)")
    one = entry(drawn, "not covered: collision: link6 and wall (1 cell)")
    apart = entry(drawn, "not covered: disconnected: forearm and shelf (1 cell)")
    unknown = entry(drawn, "not covered (1)")
    assert len({two.colour, one.colour, apart.colour, unknown.colour}) == 4
    for part, cells in ((two, {1, 2}), (one, {5}), (apart, {7})):
        places = points_at(drawn, part.path)
        centres = missed.cells.centres
        nearest = np.linalg.norm(places[:, None] - centres, axis=2).argmin(axis=1)
        assert cells <= set(nearest)
    labels = {
        text.get_text() for legend in plot_causes(missed).legends for text in legend.get_texts()
    }
    assert "collision: forearm and shelf (2)" in labels
