"""Drawn surfaces: cells are filled by their own triangles, in the colour of what became of them."""

from collections import defaultdict

import numpy as np
import pytest
from made_up import missing
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from mesh_patches import dome
from page_outline import faces_of, points_of

import coverable
from coverable import Task, check, load_result, load_robot, mesh, plot_sides, sphere, view
from feasibility.viewer import verdict_scene
from feasibility.viewer.cell_meshes import make_display_mesh, sides_of
from feasibility.viewer.figures import plot_causes, plot_graph
from surfaces.meshes.triangle_mesh import TriangleMesh

MISSED = {"mesh": {2, 3, 7, 11, 15, 20}, "grid": {5, 6, 13, 14, 15, 22}}
DOME = sphere(radius=1.0, polar_deg=(10, 90), azimuth_deg=(10, 180), side="inside")


def as_mesh(nu, nv):
    return mesh(TriangleMesh(*dome(nu, nv)), side="inside")


@pytest.fixture(scope="module", params=MISSED)
def verdict(request):
    cells = DOME.cells(5, 6)
    if request.param == "mesh":
        cells = as_mesh(30, 40).cells(count=24)
    robot = load_robot("puma560", limits="set-1")
    return missing(check(robot, cells, Task(0.005, 45)), MISSED[request.param])


def test_a_fine_mesh_is_thinned_and_its_cells_keep_their_areas():
    fine = as_mesh(70, 60).cells(count=6)
    display = make_display_mesh(fine, budget=2_000)
    assert len(display.labels) <= 2_000 < len(fine.labels)
    area = np.bincount(display.labels, display.mesh.areas, 6)
    np.testing.assert_allclose(area, fine.areas, rtol=0.06)
    assert area.sum() == pytest.approx(fine.areas.sum(), rel=0.005)
    assert len(display.borders()) > 10


def test_missed_cells_have_the_colour_of_their_cause(verdict):
    drawn = view(verdict)
    shown = {c["path"]: c for c in drawn.commands if c["type"] == "set_object"}
    entries = {entry.path: entry for entry in drawn.legend.entries}
    seen, kinds = {}, {cause.cell: cause.kind for cause in verdict.causes}
    for path in (path for path in shown if path.startswith("/cells/")):
        middles = points_of(shown[path])[faces_of(shown[path])].mean(axis=1)
        own = set(verdict.cells.locate(middles).tolist())
        seen |= dict.fromkeys(own, path)
        (words,) = {(kinds[k].replace("_", " ") if k in kinds else "") for k in own}
        label = "not covered: " * bool(words) + (words or "not covered")
        assert entries[path].label == f"{label} ({len(own)})"
    assert set(seen) == set(np.flatnonzero(~verdict.covered).tolist())
    assert len({entries[path].colour for path in seen.values()}) == len(set(seen.values()))


def test_the_two_sides_of_a_cut_are_drawn_and_named(commands):
    commands.run("check", "cut")
    verdict = load_result(commands.folder / "cut.result").verdict
    sides, root = sides_of(verdict), verdict.proof.root
    parts = {layer.entry.label: layer for layer in verdict_scene.layers(verdict)}
    for k, name in enumerate(sides.names):
        own = set(np.flatnonzero(sides.labels == k).tolist())
        if own:
            (command,) = parts[name].commands
            middles = points_of(command)[faces_of(command)].mean(axis=1)
            assert set(verdict.cells.locate(middles).tolist()) == own
    for node, side in ((root.below, 0), (root.above, 1)):  # not reached on the leaf's own side
        assert sides.labels[node.cell] == 1 - side
    marks = points_of(parts[sides.lost_name].commands[0]).reshape(2, 6, 3).mean(axis=1)
    np.testing.assert_allclose(marks, verdict.cells.centres[list(sides.lost)], atol=1e-4)
    words = [text.get_text() for text in plot_sides(verdict).legends[0].get_texts()]
    assert words[-1] == sides.lost_name


def collections(figure, kind):
    return [part for part in figure.axes[0].collections if type(part) is kind]


def test_the_flat_graph_and_causes_show_every_cell_once(verdict):
    cells = verdict.cells
    flat = (
        cells.unrolled().centres
        if cells.surface.kind == "mesh"
        else (np.degrees(np.column_stack([cells.v, cells.u])))
    )
    figure = plot_graph(verdict)
    lines = collections(figure, LineCollection)[-1].get_segments()
    drawn = {frozenset(map(tuple, np.round(line, 5).tolist())) for line in lines}
    ends = flat.round(5).tolist()
    assert drawn == {frozenset((tuple(ends[a]), tuple(ends[b]))) for a, b in verdict.graph.edges}
    assert f"{verdict.covered.sum()} of {len(cells)} cells" in figure.axes[0].get_title()
    boxes = defaultdict(int)
    for part in collections(plot_causes(verdict), PolyCollection):
        boxes[to_rgb(part.get_facecolor()[0])] += len(part.get_paths())
    assert sum(boxes.values()) == len(cells)
    for kind in coverable.CauseKind:
        own = sum(cause.kind == kind for cause in verdict.causes)
        assert boxes[to_rgb(verdict_scene.CAUSES[kind])] == own
