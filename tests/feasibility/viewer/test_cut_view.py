"""The two sides of a cut in pictures."""

from __future__ import annotations

import numpy as np
import pytest
from cut_verdicts import ONE_CUT, TWO_CUTS, cut_verdict, explored
from fabricated import DOME, verdict_on

from feasibility.cut_tree import CutTree, Leaf
from feasibility.cut_words import sentence
from feasibility.roadmap.graph import NODES
from feasibility.viewer import plot_sides, view
from feasibility.viewer.cut_sides import ABOVE, BELOW, BOTH, COLOURS, sides_of
from feasibility.viewer.scene import layers
from robots import load_robot


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
        assert parts[name].count == (sides.labels == k).sum() > 0
    assert parts[sides.lost_name].count == 2
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
