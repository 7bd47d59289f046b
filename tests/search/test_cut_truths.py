"""Proofs of cuts on arms so simple that what divides their motions is known."""

import numpy as np
import pytest
from arm_urdfs import FREE, joint
from cut_attempts import nothing, prove
from random_arms import robot_of

from coverable import Task, cylinder, plane
from feasibility.cut_tree import Cut, Leaf
from feasibility.roadmap.proofs.regions import limits_of
from feasibility.roadmap.proofs.ruling import Ruling

ANY_AXIS = Task(0.0, 180.0, 1e-3)


def rad(*degrees):
    return tuple(np.radians(degrees).tolist())


def two_links(first=(-40, 40), second=(-170, 170)):
    """Two links of 0.3 m in the plane z = 0."""
    elbow = joint(2, xyz=(0.3, 0, 0), limits=rad(*second))
    return robot_of([joint(1, limits=rad(*first)), elbow, joint(3, "fixed", (0.3, 0, 0))])


def arc(radius):
    """An arc of 20 degrees to either side, about the first axis, of no more height than needed."""
    return cylinder(radius, (-20, 20), (-1e-3, 1e-3), side="outside").cells(5, 1)


def sliding_crank(slide=(-0.7, 0.7), kind="continuous", limits=FREE, roll=()):
    """A slide along x that carries a link of 0.5 m about z."""
    sliding = joint(1, "prismatic", axis=(1, 0, 0), limits=slide)
    tip = joint(3 + len(roll), "fixed", (0.5, 0, 0))
    return robot_of([sliding, joint(2, kind, limits=limits), *roll, tip])


def line(low=-0.6, high=0.6):
    """The line y = 0.3, where the crank stands at 37 or at 143 degrees."""
    return plane((low, high), (0.299, 0.301), side="outside").cells(6, 1)


def test_elbow_up_and_elbow_down():
    """At 0.5 m the elbow is bent by 67 degrees, the first joint then 34 from the target."""
    proving = prove(two_links(), arc(0.5), ANY_AXIS)
    assert not proving.exploration.complete
    assert proving.exploration.reached.all()
    tree = proving.tree
    assert (tree.kind, tree.opened) == ("cut", ())
    assert isinstance(tree.root, Cut)
    assert tree.root.joint == 1
    assert abs(np.degrees(tree.root.value)) < 67.0
    cells = {tree.root.below.cell, tree.root.above.cell}
    assert cells <= {0, 1, 3, 4}
    assert len(cells) == 2


@pytest.mark.parametrize(("first", "second"), [((-60, 60), (-170, 170)), ((-40, 40), (-30, 170))])
def test_what_can_be_covered_is_not_proved(first, second):
    """With wider limits, or where one elbow is not there at all, other things are true."""
    proving = prove(two_links(first, second), arc(0.5), ANY_AXIS)
    if second[0] > -67:
        assert isinstance(proving.tree.root, Leaf)
    else:
        assert proving.exploration.complete


def test_elbows_that_meet_are_not_divided():
    """Stretched out, at 0.6 m less the tolerance, elbow up and elbow down are one component."""
    assert prove(two_links(), arc(0.5995), ANY_AXIS).tree is None


def test_a_slide_and_a_crank_that_turns_freely():
    """The crank is never upright over the line, nor hanging: its circle is opened and cut."""
    tree = prove(sliding_crank(), line(), ANY_AXIS).tree
    (opened,) = tree.opened
    values = [opened[1], *(n.value for n in tree.nodes() if isinstance(n, Cut) and n.joint == 1)]
    assert opened[0] == 1
    heights = np.sin(values)
    assert (np.abs(heights - 0.6) > 0.01).all()
    assert heights.max() > 0.6  # between the two, above
    assert heights.min() < 0.6  # and below


def test_a_joint_that_turns_about_the_tool_axis_needs_no_opening():
    """It is anywhere, and no cut goes through it: one turn of it will do for every statement."""
    roll = [joint(3, "continuous", axis=(1, 0, 0), limits=FREE)]
    tree = prove(sliding_crank(roll=roll), line(), ANY_AXIS).tree
    assert [j for j, _ in tree.opened] == [1]
    assert all(n.joint != 2 for n in tree.nodes() if isinstance(n, Cut))


def test_a_cut_through_a_slide():
    """On x = 0 the slide is 0.2 to 0.4 m from the middle, on either side: the middle is a cut."""
    cells = plane((-1e-3, 1e-3), (0.3, 0.45), side="outside").cells(1, 4)
    proving = prove(sliding_crank((-0.5, 0.5), "revolute", rad(5, 175)), cells, ANY_AXIS)
    region, places = limits_of(proving.prover.arrays, proving.prover.places), proving.prover.places
    for value, expected in ((0.0, True), (-0.2, True), (0.35, False), (-0.22, False)):
        ruling = proving.ruled(region.on(0, value), places, 2)
        assert (ruling is Ruling.PROVED) == expected, value


@pytest.mark.parametrize("slide", [(-0.7, np.inf), (-np.inf, np.inf)])
def test_slides_without_ends(slide):
    """Where they would save the motion it is found, and elsewhere the proof holds all of them."""
    robot = sliding_crank(kind="revolute", limits=rad(0, 180)).with_limits({"j1": slide})
    assert prove(robot, line(), ANY_AXIS).exploration.complete
    proving = prove(robot, line(-1.4, 0.6), ANY_AXIS)
    if slide[0] > -1.0:
        assert isinstance(proving.tree.root, Leaf)
    else:
        assert proving.exploration.complete


def test_several_windings_are_several_places():
    """Elbow up and down as above, with a first joint of limits that hold two turns."""
    robot = two_links((-40, 40)).with_limits({"j1": rad(320, 400)})
    proving = prove(robot, arc(0.5), ANY_AXIS)
    assert proving.tree.root.joint == 1
    for region, node in proving.statements():
        assert proving.ruling(region, node) is Ruling.PROVED
    wider = robot.with_limits({"j1": rad(-400, 400)})
    assert prove(wider, arc(0.5), ANY_AXIS).exploration.complete


def test_nothing_known_proves_nothing_false():
    """No components, and cells that the arm covers: no tree."""
    attempt = prove(two_links((-60, 60)), arc(0.5), ANY_AXIS).prover.attempt([], 20_000, nothing)
    assert attempt.tree is None
    assert attempt.seeds
