"""Drawn surfaces: cells are filled by their own triangles, in the colour of what became of them."""

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
from made_up import missing
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from page_outline import faces_of, points_of
from specimens import SMOOTH, flat

import coverable
from coverable import Task, check, load_result, load_robot, mesh, plot_sides, view
from feasibility.viewer import verdict_scene
from feasibility.viewer.cell_meshes import make_display_mesh, sides_of
from feasibility.viewer.figures import plot_causes, plot_graph, plot_transition, unrolled_edges
from feasibility.viewer.meshes import tubes

MISSED = {"mesh": {2, 3, 5, 6, 7, 9, 11, 12, 15, 17, 20}, "grid": {*range(5, 10), *range(13, 19)}}


@pytest.fixture(scope="module", params=MISSED)
def verdict(request):
    cells = SMOOTH["dome"].cells(5, 6)
    if request.param == "mesh":
        cells = mesh(flat("dome", 36).mesh, side="inside").cells(count=24)
    robot = load_robot("puma560", limits="set-1")
    return missing(check(robot, cells, Task(0.005, 45)), MISSED[request.param])


def test_a_fine_mesh_is_thinned_and_its_cells_keep_their_areas():
    fine = flat("dome", 65).cells(count=6)
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
    seen, said = {}, dict.fromkeys(range(len(verdict.cells)), "not covered")
    for cause in verdict.causes:
        pair = f": {' and '.join(cause.pair)}" if cause.pair else ""
        said[cause.cell] = f"not covered: {cause.kind.replace('_', ' ')}{pair}"
    for path in (path for path in shown if path.startswith("/cells/")):
        middles = points_of(shown[path])[faces_of(shown[path])].mean(axis=1)
        own = set(verdict.cells.locate(middles).tolist())
        seen |= dict.fromkeys(own, path)
        (words,) = {said[k] for k in own}
        number = "1 cell" if "shelf" in words else len(own)
        assert entries[path].label == f"{words} ({number})"
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
    deep = replace(root, above=replace(root, value=root.value + 1e-3, below=root.above))
    deeper = replace(verdict, proof=replace(verdict.proof, root=deep))
    assert sides_of(deeper).lost_name == "proved: lost in one region or another (2)"


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
        own = sum(cause.kind == kind and cause.pair is None for cause in verdict.causes)
        assert boxes[to_rgb(verdict_scene.CAUSES[kind])] == own
    assert [boxes[to_rgb(colour)] for colour in verdict_scene.PAIRS[:3]] == [1, 1, 0]


def test_edges_over_a_seam_reach_either_border_and_a_transition_is_that_of_its_edge(verdict):
    tube = coverable.cylinder(0.5, (0, 360), (0.0, 0.4)).cells(4, 1)
    lines = unrolled_edges(replace(verdict, cells=tube, graph=tube.graph()))
    angles = sorted(sorted(line[:, 1].round(6).tolist()) for line in lines)
    assert angles == [[0, 45], [45, 135], [135, 225], [225, 315], [315, 360]]
    for nothing in ([], [np.zeros((3, 3))]):  # such as the trail of a tool that rests
        assert [part.shape for part in tubes(nothing, 0.01)] == [(0, 3), (0, 3)]
    a, b = max(verdict.graph.edges)
    said = f": {len(verdict.graph.edges[a, b]['motion'])} configurations"
    assert plot_transition(verdict, (b, a)).axes[0].get_title().endswith(said)
    with pytest.raises(ValueError, match="no edge between the cells 6 and 5 with a motion"):
        plot_transition(verdict, (6, 5))
