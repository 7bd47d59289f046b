"""The two sides of a cut in pictures."""

from __future__ import annotations

import numpy as np
import pytest
from cut_verdicts import ONE_CUT, TWO_CUTS, cut_verdict, explored
from fabricated import DOME, verdict_on
from numpy.typing import NDArray

from feasibility.cut_tree import CutTree, Leaf
from feasibility.cut_words import sentence
from feasibility.roadmap.graph import NODES
from feasibility.viewer import plot_sides, view
from feasibility.viewer.cut_sides import ABOVE, BELOW, BOTH, COLOURS, sides_of
from feasibility.viewer.scene import Layer, layers
from feasibility.viewer.threejs import numbers_of
from robots import load_robot


def drawn(layer: Layer) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The vertices (V, 3) m and faces (F, 3) of a layer of one object."""
    (command,) = layer.commands
    data = command["object"]["geometries"][0]["data"]
    points = numbers_of(data["attributes"]["position"]).reshape(-1, 3)
    return points, numbers_of(data["index"]).reshape(-1, 3).astype(np.int64)


@pytest.mark.parametrize("number", [ONE_CUT, TWO_CUTS])
def test_sides_are_those_of_every_known_configuration(number: int) -> None:
    verdict, exploration = cut_verdict(number), explored(number)[0]
    sides, proof = sides_of(verdict), verdict.proof
    assert sides is not None
    assert proof is not None
    weights = np.array(proof.root.weights)
    nodes = slice(int(exploration.roadmap.counters[NODES]))
    above = exploration.roadmap.q[nodes] @ weights > proof.root.value
    found = np.zeros((2, len(verdict.cells)), dtype=bool)
    found[above.astype(int), exploration.roadmap.cell[nodes]] = True
    expected = np.where(found.all(axis=0), BOTH, np.where(found[1], ABOVE, BELOW))
    assert np.array_equal(sides.labels, np.where(found.any(axis=0), expected, -1))
    assert set(sides.lost) == {leaf.cell for leaf in proof.leaves()}
    # A leaf's cell is not reached on the leaf's own side.
    for side, node in ((0, proof.root.below), (1, proof.root.above)):
        if isinstance(node, Leaf):
            assert not found[side, node.cell]


@pytest.mark.parametrize("number", [ONE_CUT, TWO_CUTS])
def test_the_first_side_in_the_legend_names_its_joint(number: int) -> None:
    """Sides without cells have no entry, so that either may be the first."""
    parts = [layer.entry.label for layer in layers(cut_verdict(number))]
    first = next(label for label in parts if label.startswith(("below", "above")))
    assert "joint" in first


def test_the_view_has_both_sides_with_a_legend() -> None:
    verdict = cut_verdict(ONE_CUT)
    parts = {layer.entry.label: layer for layer in layers(verdict)}
    sides = sides_of(verdict)
    assert sides is not None
    for k, (name, colour) in enumerate(zip(sides.names, COLOURS, strict=True)):
        assert parts[name].entry.colour == colour
        assert parts[name].entry.shown
        points, faces = drawn(parts[name])
        shown = verdict.cells.locate(points[faces].mean(axis=1))
        assert set(shown.tolist()) == set(np.flatnonzero(sides.labels == k).tolist())
        assert len(shown)
    marks, _ = drawn(parts[sides.lost_name])
    lost = verdict.cells.centres[list(sides.lost)]
    assert len(lost) == 2
    np.testing.assert_allclose(marks.reshape(2, 6, 3).mean(axis=1), lost, atol=1e-4)
    (missed,) = [layer for name, layer in parts.items() if name.startswith("not covered")]
    assert not missed.entry.shown  # these cells are in the colour of their side
    page = view(verdict, "apart").html()
    for name in (*sides.names, sides.lost_name):
        assert name in page
    assert verdict.proof is not None
    assert sentence(verdict.proof, verdict.robot, verdict.cells) in page


@pytest.mark.parametrize("number", [ONE_CUT, TWO_CUTS])
def test_the_figure_has_one_shape_for_each_cell(number: int) -> None:
    verdict = cut_verdict(number)
    figure = plot_sides(verdict)
    sides = sides_of(verdict)
    assert sides is not None
    drawn = [collection for collection in figure.axes[0].collections if len(collection.get_paths())]
    counts = [(c.get_facecolor()[0][:3].tolist(), len(c.get_paths())) for c in drawn]
    some = [k for k in range(3) if (sides.labels == k).any()]
    for k in some:
        assert (pytest.approx(list(COLOURS[k])), int((sides.labels == k).sum())) in counts
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == [*(sides.names[k] for k in some), sides.lost_name]


def test_no_sides_without_a_cut() -> None:
    made_up = verdict_on(load_robot("puma560"), DOME.cells(3, 3), missed=(4,))
    assert sides_of(made_up) is None
    assert not any((layer.entry.path or "").startswith("/cut") for layer in layers(made_up))
    with pytest.raises(ValueError, match="proof is a cut"):
        plot_sides(made_up)
    verdict = cut_verdict(ONE_CUT)
    fields = {name.removeprefix("_"): value for name, value in vars(verdict).items()}
    for change in ({"proof": CutTree(Leaf(0))}, {"postures": None}):
        assert sides_of(type(verdict)(**{**fields, **change})) is None
