"""Pictures of meshes: what is drawn is the mesh, its cells and their curves, and no more."""

from __future__ import annotations

import re
from collections import defaultdict

import numpy as np
import pytest
import trimesh
from fabricated import DOME, TASK, every_cause, verdict_on
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_rgb
from mesh_patches import grid

from feasibility.viewer import cell_meshes as cell_shapes
from feasibility.viewer import scene, view
from feasibility.viewer.cell_meshes import make_display_mesh
from feasibility.viewer.figures import plot_causes, plot_graph, plot_transition
from feasibility.viewer.scene import edge_lines, patch_layers
from robots import load_robot
from surfaces import mesh
from surfaces.meshes.cells import MeshCells

COUNT = 24
MISSED = {2, 3, 7, 11, 15, 20}


def triangles(nu, nv, shape):
    """A unit square bent by (u, v) -> points, as a mesh of 2 nu nv triangles."""
    u, v, faces = grid(nu, nv)
    return trimesh.Trimesh(shape(u, v), faces, process=False)


def sheet(u, v):
    return np.stack([u, 0.7 * v, 0.0 * u], axis=-1)


def wave(u, v):
    return np.stack([u, v, 0.1 * np.sin(5.0 * u) * np.cos(4.0 * v)], axis=-1)


def dome(u, v):
    return DOME.point(np.radians(10 + 80 * u), np.radians(10 + 170 * v))


def blocks(surface, across):
    """Cells of a mesh as squares of a grid over x and y; quicker than cutting it."""
    middles = surface.mesh.vertices[surface.mesh.faces].mean(axis=1)
    low, high = surface.mesh.vertices.min(axis=0), surface.mesh.vertices.max(axis=0)
    share = (middles - low)[:, :2] / (high - low)[:2]
    row, column = np.floor(across * share).astype(int).T
    return MeshCells.of(surface, row * across + column)


@pytest.fixture(scope="module")
def puma():
    return load_robot("puma560", limits="set-1")


@pytest.fixture(scope="module")
def cells():
    return mesh(triangles(30, 40, dome), side="inside").cells(count=COUNT)


@pytest.fixture(scope="module")
def fine():
    """30,000 triangles in 25 cells, turned and moved."""
    surface = mesh(triangles(150, 100, wave), position=(0.3, -0.2, 0.5), rpy_deg=(20, -40, 70))
    return MeshCells.of(surface, blocks(mesh(triangles(150, 100, wave)), 5).labels)


@pytest.fixture(scope="module")
def verdict(puma, cells):
    return verdict_on(puma, cells, missed=MISSED, causes=every_cause(MISSED))


def areas_of(vertices, faces):
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0


def edges_of(faces, labels):
    """Labels of the faces at each edge, edge by edge."""
    found = defaultdict(list)
    for face, label in zip(faces.tolist(), labels.tolist(), strict=True):
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            found[min(a, b), max(a, b)].append(label)
    return found


def objects(commands):
    return {c["path"]: c["object"]["geometries"][0]["data"] for c in commands if "object" in c}


def points_of(geometry):
    return np.frombuffer(geometry["attributes"]["position"]["array"].data, "<f4").reshape(-1, 3)


def faces_of(geometry):
    array = geometry["index"]
    kind = {"Uint16Array": "<u2", "Uint32Array": "<u4"}[array["type"]]
    return np.frombuffer(array["array"].data, kind).reshape(-1, 3).astype(np.int64)


def drawn_areas(geometry):
    return areas_of(points_of(geometry).astype(float), faces_of(geometry))


def test_each_cell_is_filled_by_its_own_triangles(cells):
    for k in range(COUNT):
        drawn = cell_shapes.patch(cells, np.array([k]))
        assert areas_of(drawn.vertices, drawn.faces).sum() == pytest.approx(cells.areas[k])
        assert set(cells.locate(drawn.vertices[drawn.faces].mean(axis=1)).tolist()) == {k}
        a, b, c = np.moveaxis(drawn.vertices[drawn.faces], 1, 0)
        looks = np.cross(b - a, c - a)
        assert ((looks * drawn.normals[drawn.faces[:, 0]]).sum(axis=1) > 0.0).all()
        np.testing.assert_allclose(np.linalg.norm(drawn.normals, axis=1), 1.0, atol=1e-12)
    whole = cell_shapes.patch(cells, np.arange(COUNT))
    assert len(whole.vertices) == len(cells.surface.mesh.vertices), "triangles share corners"
    closest_point = cells.surface.closest(whole.vertices)
    np.testing.assert_allclose(closest_point.height, 0.0, atol=1e-12)
    np.testing.assert_allclose(closest_point.normal, whole.normals, atol=1e-6)


def test_borders_are_the_edges_between_cells_and_the_rim(cells):
    around = edges_of(cells.surface.mesh.faces, cells.labels)
    expected = {edge for edge, labels in around.items() if len(labels) == 1 or len(set(labels)) > 1}
    lines = cell_shapes.borders(cells)
    numbers = {tuple(p): k for k, p in enumerate(cells.surface.mesh.vertices.tolist())}
    drawn = [tuple(sorted(numbers[tuple(p)] for p in line)) for line in lines.tolist()]
    assert len(drawn) == len(expected)
    assert set(drawn) == expected
    length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum()
    cone_chord = cells.surface.mesh.edges.border_lengths.sum()
    assert length == pytest.approx(cells.figures.borders.lengths.sum() + cone_chord)


def test_creases_stay_sharp():
    """A box keeps its three normals at a corner, and has no border within one side."""
    box = mesh(trimesh.creation.box((0.2, 0.3, 0.4)))
    sides = np.argmax(np.abs(box.mesh.face_normals), axis=1)
    sides = 2 * sides + (box.mesh.face_normals.max(axis=1) > 0.5)
    cells = MeshCells.of(box, sides)
    drawn = cell_shapes.patch(cells, np.arange(6))
    assert len(drawn.vertices) == 24
    a, b, c = np.moveaxis(drawn.vertices[drawn.faces], 1, 0)
    flat = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a), axis=1)[:, None]
    np.testing.assert_allclose(drawn.normals[drawn.faces], flat[:, None].repeat(3, 1), atol=1e-12)
    lines = cell_shapes.borders(cells)
    lengths = np.sort(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1))
    np.testing.assert_allclose(lengths, np.repeat([0.2, 0.3, 0.4], 4))


def test_shrunk_cells_part_from_their_neighbours():
    """On a flat sheet a cell that is drawn a fifth smaller has 0.64 of its area."""
    cells = mesh(triangles(30, 30, sheet)).cells(count=12)
    drawn = cell_shapes.patch(cells, np.arange(12), inset=0.2)
    area = np.bincount(cells.labels, areas_of(drawn.vertices, drawn.faces), 12)
    np.testing.assert_allclose(area, 0.64 * cells.areas, rtol=1e-9)
    used = [set(drawn.faces[cells.labels == k].ravel().tolist()) for k in range(12)]
    assert sum(map(len, used)) == len(set().union(*used)), "no corner belongs to two cells"
    corners = cells.surface.mesh.vertices[cells.surface.mesh.faces]
    centres = cells.centres[cells.labels][:, None]
    np.testing.assert_allclose(drawn.vertices[drawn.faces], centres + 0.8 * (corners - centres))


def test_a_fine_mesh_is_thinned_and_its_cells_still_meet_as_they_did(fine):
    display = make_display_mesh(fine, budget=4_000)
    assert len(display.faces) <= 4_000 < len(fine.labels)
    turned = fine.surface.mesh.vertices @ fine.surface.rotation.T + fine.surface.position
    corners = set(map(tuple, turned.round(12).tolist()))
    assert set(map(tuple, display.vertices.round(12).tolist())) <= corners
    area = np.bincount(display.labels, areas_of(display.vertices, display.faces), 25)
    np.testing.assert_allclose(area, fine.areas, rtol=0.06)
    assert area.sum() == pytest.approx(fine.areas.sum(), rel=0.005)
    closest_point = fine.surface.closest(display.vertices)
    assert ((closest_point.normal * display.normals).sum(axis=1) > np.cos(np.radians(2.0))).all()
    around = edges_of(display.places[display.faces], display.labels)
    met = {tuple(sorted(set(labels))) for labels in around.values() if len(set(labels)) == 2}
    assert met == set(map(tuple, fine.pairs.tolist()))
    lines = display.borders()
    length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum()
    cone_chord = fine.surface.mesh.edges.border_lengths.sum()
    assert length == pytest.approx(fine.figures.borders.lengths.sum() + cone_chord, rel=0.02)
    assert len(lines) < len(fine.borders()) / 2


def test_small_cells_survive_thinning():
    """Single faces among large cells are drawn, however coarse the picture."""
    surface = mesh(triangles(60, 60, wave))
    labels = blocks(surface, 2).labels.copy()
    labels[[100, 2000, 5000]] = [4, 5, 6]
    cells = MeshCells.of(surface, labels)
    display = make_display_mesh(cells, budget=500)
    assert len(display.faces) < 1_500
    assert set(display.labels.tolist()) == set(range(7))
    area = np.bincount(display.labels, areas_of(display.vertices, display.faces), 7)
    assert (area[4:] > 0.0).all()


def test_a_mesh_within_the_budget_is_drawn_as_it_is(fine):
    display = make_display_mesh(fine, budget=len(fine.labels))
    assert len(display.faces) == len(fine.labels)
    np.testing.assert_array_equal(display.labels, fine.labels)
    assert len(display.borders()) == len(fine.borders())


def test_edges_run_from_target_to_target_at_the_standoff(verdict):
    cells = verdict.cells
    lines, points = edge_lines(verdict), TASK.targets(cells).points
    assert len(lines) == verdict.graph.number_of_edges() > COUNT
    row = {tuple(pair): k for k, pair in enumerate(cells.pairs.tolist())}
    for pair, line in zip(verdict.graph.edges, lines, strict=True):
        np.testing.assert_allclose(line[[0, -1]], points[list(pair)], atol=1e-9)
        closest_point, normal = cells.curves.deviations[row[tuple(sorted(pair))]]
        height = cells.surface.closest(line).height
        allowed = (
            closest_point + TASK.standoff * normal + 1e-5
        )  # the facets of a mesh are not its normals
        assert np.abs(height + TASK.standoff).max() <= allowed, "on the tool's side, not through it"


def test_missed_cells_have_the_colour_of_their_cause(verdict):
    drawn = view(verdict)
    shown = objects(drawn.commands)
    for group in scene.missed_groups(verdict.causes, np.flatnonzero(~verdict.covered)):
        kind, which = group.kind, group.which
        words = "not covered" if kind is None else f"not covered: {kind.replace('_', ' ')}"
        data = shown[f"/cells/{words} ({len(which)})"]
        middles = points_of(data).astype(float)[faces_of(data)].mean(axis=1)
        assert set(verdict.cells.locate(middles).tolist()) == set(which.tolist())
        full = verdict.cells.areas[which].sum()
        assert drawn_areas(data).sum() == pytest.approx(0.94**2 * full, rel=0.02)
    labels = [entry.label for entry in drawn.legend.entries]
    assert f"{COUNT} cells" in labels, "not 24 cells (24): a mesh is no grid"
    edges = verdict.graph.number_of_edges()
    assert f"{edges} edges of G (of {len(verdict.cells.pairs)} pairs)" in labels
    surface = shown["/surface/patch"]
    assert drawn_areas(surface).sum() == pytest.approx(verdict.cells.areas.sum(), rel=1e-3)


def test_the_page_of_a_large_mesh_is_small_and_fetches_nothing(puma):
    """120,000 triangles as a page of less than two million bytes, most of them the viewer's."""
    cells = blocks(mesh(triangles(300, 200, sheet), side="inside", position=(-0.5, 0.2, -0.3)), 4)
    page = view(verdict_on(puma, cells, missed=set(range(1, 16)))).html()
    assert len(page) < 2_000_000
    text = re.sub(r'id="(program|commands)">[^<]*<', "", page)
    assert "://" not in text.replace('"ws://"', "")
    assert not re.search(r"\s(src|href|srcset|data)=", text)


def test_a_closed_mesh_that_is_one_cell_is_drawn(puma):
    """No border, no neighbour, no edge: the ball is still framed and filled."""
    ball = mesh(trimesh.creation.icosphere(3, 0.2), position=(2.0, 0.0, 0.5))
    drawn = view(verdict_on(puma, MeshCells.of(ball, np.zeros(1280, dtype=int)), missed={0}))
    assert "1 cell" in [entry.label for entry in drawn.legend.entries]
    surface = objects(drawn.commands)["/surface/patch"]
    assert drawn_areas(surface).sum() == pytest.approx(ball.mesh.area, rel=1e-3)
    assert drawn.camera.target[0] > 0.8, "between the arm and the ball"


def test_patches_are_coloured_by_their_number(cells):
    labels = np.arange(COUNT) % 4 - 1  # some cells in none
    layers = patch_layers(cells, labels, ["a <b>", "c/d", "e", "empty"])
    assert [layer.entry.label for layer in layers] == ["a <b>", "c/d", "e"]
    assert len({layer.entry.colour for layer in layers}) == 3
    for k, layer in enumerate(layers):
        (command,) = layer.commands
        assert re.fullmatch(r"/patches/[^/<>]+", command["path"])
        (data,) = objects([command]).values()
        middles = points_of(data).astype(float)[faces_of(data)].mean(axis=1)
        assert set(cells.locate(middles).tolist()) == set(np.flatnonzero(labels == k).tolist())


def collections(figure, kind):
    return [part for part in figure.axes[0].collections if type(part) is kind]


def test_the_flat_graph_shows_every_cell_with_its_border(verdict):
    figure = plot_graph(verdict)
    flat = verdict.cells.unrolled()
    borders, lines = collections(figure, LineCollection)
    assert len(borders.get_segments()) == COUNT
    for drawn, outline in zip(borders.get_segments(), flat.outlines, strict=True):
        np.testing.assert_allclose(drawn, outline)
    drawn = {frozenset(map(tuple, line.round(9).tolist())) for line in lines.get_segments()}
    ends = flat.centres.round(9).tolist()
    assert drawn == {frozenset((tuple(ends[a]), tuple(ends[b]))) for a, b in verdict.graph.edges}
    dots = {d.get_label(): d.get_offsets() for d in collections(figure, PathCollection)}
    np.testing.assert_allclose(dots["covered"], flat.centres[verdict.covered])
    np.testing.assert_allclose(dots["not covered"], flat.centres[~verdict.covered])
    assert figure.axes[0].get_aspect() == 1.0, "true to scale"
    assert figure.axes[0].get_title().startswith("puma560 on a mesh: infeasible, 18 of 24 cells")


def test_the_flat_causes_show_every_cell_once(verdict):
    figure = plot_causes(verdict)
    outlines = verdict.cells.unrolled().outlines
    shown = defaultdict(list)
    for part in collections(figure, PolyCollection):
        shown[to_rgb(part.get_facecolor()[0])] += [path.vertices for path in part.get_paths()]
    assert sum(map(len, shown.values())) == COUNT
    for group in scene.missed_groups(verdict.causes, np.flatnonzero(~verdict.covered)):
        colour = scene.MISSED if group.kind is None else scene.CAUSES[group.kind]
        for drawn, k in zip(shown[to_rgb(colour)], group.which, strict=True):
            np.testing.assert_allclose(drawn[: len(outlines[k])], outlines[k])


def test_a_transition_names_cells_of_a_mesh_by_number(verdict):
    a, b = max(tuple(sorted(edge)) for edge in verdict.graph.edges)
    figure = plot_transition(verdict, (b, a))
    assert figure.axes[0].get_title().startswith(f"From E-cell {a} to {b}:")
    names = {text.get_text() for text in figure.axes[0].get_legend().get_texts()}
    assert {f"E-cell {a}", f"E-cell {b}"} <= names
    assert "off the patch" not in names
