"""Flat pictures: what they show is what the verdict holds."""

import sys

import matplotlib as mpl
import numpy as np
import pytest
from fabricated import DOME, STEPS, every_cause, verdict_on
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_rgb

from feasibility import CauseKind
from feasibility.viewer.figures import (
    cells_below,
    plot_causes,
    plot_graph,
    plot_transition,
    unrolled_edges,
)
from feasibility.viewer.scene import CAUSES, MISSED
from robots import load_robot
from surfaces import cylinder

LOST = {5, 6, 13, 14, 15, 22}


@pytest.fixture(scope="module")
def puma():
    return load_robot("puma560", limits="set-1")


@pytest.fixture(scope="module")
def verdict(puma):
    return verdict_on(puma, DOME.cells(5, 6), missed=LOST, causes=every_cause(LOST))


def collections(figure, kind):
    return [part for part in figure.axes[0].collections if type(part) is kind]


def offsets(figure, label):
    (dots,) = [d for d in collections(figure, PathCollection) if d.get_label() == label]
    return dots


def test_the_graph_is_unrolled_with_missed_cells_in_red(verdict):
    figure = plot_graph(verdict)
    (lines,) = collections(figure, LineCollection)
    drawn = {frozenset(map(tuple, np.round(segment, 6))) for segment in lines.get_segments()}
    centre = np.degrees(np.column_stack([verdict.cells.v, verdict.cells.u])).round(6)
    expected = {frozenset([tuple(centre[a]), tuple(centre[b])]) for a, b in verdict.graph.edges}
    assert drawn == expected
    missed = offsets(figure, "not covered")
    assert np.allclose(missed.get_offsets(), centre[sorted(LOST)], atol=1e-5)
    assert to_rgb(missed.get_facecolor()[0]) == pytest.approx(MISSED)
    assert np.allclose(offsets(figure, "start").get_offsets(), centre[[0]], atol=1e-5)
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("v (degrees)", "u (degrees)")
    said = f"infeasible, 24 of 30 cells, {len(expected)} edges"
    assert axes.get_title() == f"puma560 on a sphere: {said}"
    assert plot_graph(verdict, title="4b").axes[0].get_title() == f"4b: {said}"


def test_edges_over_a_seam_leave_at_one_border_and_come_in_at_the_other(puma):
    tube = cylinder(0.5, angle_deg=(0, 360), height=(0.0, 0.4))
    verdict = verdict_on(puma, tube.cells(4, 1))
    lines = unrolled_edges(verdict)
    assert verdict.graph.number_of_edges() == 4
    assert len(lines) == 5
    angles = [sorted(line[:, 1].round(6).tolist()) for line in lines]
    assert sorted(angles) == [[0, 45], [45, 135], [135, 225], [225, 315], [315, 360]]
    assert plot_graph(verdict).axes[0].get_xlabel() == "v (m)"


def test_each_cause_has_its_colour_and_its_count(verdict):
    figure = plot_causes(verdict)
    boxes = {
        to_rgb(part.get_facecolor()[0]): [p.vertices[:4].mean(axis=0) for p in part.get_paths()]
        for part in collections(figure, PolyCollection)
    }
    centre = np.degrees(np.column_stack([verdict.cells.v, verdict.cells.u]))
    for kind in CauseKind:
        cells = [cause.cell for cause in verdict.causes if cause.kind == kind]
        assert np.allclose(boxes[CAUSES[kind]], centre[cells])
    assert np.allclose(boxes[MISSED], centre[[max(LOST)]])
    labels = {text.get_text() for text in figure.legends[0].get_texts()}
    assert {"covered (24)", "out of reach (1)", "joint limits (1)", "cause not known (1)"} <= labels
    assert sum(len(places) for places in boxes.values()) == 30


def test_a_transition_shows_every_waypoint_over_its_cell(verdict):
    a, b = max(verdict.graph.edges)
    figure = plot_transition(verdict, (b, a))
    axes = figure.axes[0]
    motion = verdict.graph.edges[a, b]["motion"]
    moving = np.sort(np.argsort(-np.ptp(motion, axis=0))[:2])
    dots = np.concatenate([d.get_offsets() for d in collections(figure, PathCollection)])
    shown = np.degrees(motion[:, moving])
    assert len(dots) == STEPS
    assert {tuple(row) for row in dots.round(9)} == {tuple(row) for row in shown.round(9)}
    names = [verdict.robot.joint_names[joint] for joint in moving]
    assert [axes.get_xlabel(), axes.get_ylabel()] == [f"{name} (degrees)" for name in names]
    over = cells_below(verdict, motion)
    assert (over[0], over[-1]) == (min(a, b), max(a, b))
    assert figure.axes[0].get_title().endswith(f"{STEPS} configurations")


def test_the_transition_that_moves_two_joints_most_is_the_default(verdict):
    ranges = {}
    for a, b, motion in verdict.graph.edges(data="motion"):
        ranges[min(a, b), max(a, b)] = np.sort(np.ptp(motion, axis=0))[-2]
    most = max(ranges, key=ranges.get)
    names = [f"({cell // 6}, {cell % 6})" for cell in most]
    title = plot_transition(verdict).axes[0].get_title()
    assert title.startswith(f"From E-cell {names[0]} to {names[1]}:")


def test_an_edge_that_is_not_there_is_named(verdict, puma):
    with pytest.raises(ValueError, match="no edge between the cells 0 and 29"):
        plot_transition(verdict, (0, 29))
    with pytest.raises(ValueError, match="no edge with a motion"):
        plot_transition(verdict_on(puma, DOME.cells(1, 1)))


def test_nothing_to_cover_makes_a_picture_too(puma):
    empty = verdict_on(puma, DOME.cells(0, 5))
    for figure in (plot_graph(empty), plot_causes(empty)):
        assert figure._repr_png_().startswith(b"\x89PNG")


def test_plots_leave_matplotlib_alone_and_need_no_display(verdict):
    before = dict(mpl.rcParams)
    pyplot = "matplotlib.pyplot" in sys.modules
    png = plot_graph(verdict)._repr_png_()
    assert png.startswith(b"\x89PNG")
    assert plot_causes(verdict)._repr_png_() != png
    assert dict(mpl.rcParams) == before
    assert ("matplotlib.pyplot" in sys.modules) == pyplot
