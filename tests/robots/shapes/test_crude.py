"""Links that one hull stands for badly are cut into pieces from the start; others are not."""

from __future__ import annotations

from collections import Counter

import pytest

from robots import load_robot
from robots.shapes import link_pairs, link_shapes, with_crude_links_cut
from robots.shapes.sampling import PairSampling, random_configurations


def bodies_of_each(shapes) -> Counter[str]:
    return Counter(body.owner for body in shapes.polytopes)


def test_the_l_shaped_links_of_a_ur5_are_cut_and_then_meet_as_rarely_as_they_do():
    robot = load_robot("ur5")
    hulls = link_shapes(robot)
    pairs = link_pairs(robot, hulls).checked
    cut = with_crude_links_cut(robot, hulls, pairs)
    before, after = bodies_of_each(hulls), bodies_of_each(cut)
    more = {owner for owner in after if after[owner] > before[owner]}
    assert {"base_link", "upper_arm_link", "forearm_link"} <= more
    assert "ee_link" not in more
    assert cut.solids == hulls.solids
    q = random_configurations(robot)[200:]  # others than those that were looked at
    for pair in (("base_link", "upper_arm_link"), ("forearm_link", "wrist_2_link")):
        crude, fine, exact = (
            PairSampling(robot, bodies).collisions([pair], q).mean()
            for bodies in (hulls.polytopes, cut.polytopes, cut.solids)
        )
        assert crude > exact + 0.2
        assert exact <= fine < exact + 0.05


@pytest.mark.parametrize("name", ["panda", "puma560"])
def test_arms_whose_hulls_do_are_left_as_they_are(name):
    robot = load_robot(name)
    hulls = link_shapes(robot)
    assert with_crude_links_cut(robot, hulls, link_pairs(robot, hulls).checked) is hulls


def test_without_pairs_nothing_is_cut():
    robot = load_robot("ur5")
    hulls = link_shapes(robot)
    assert with_crude_links_cut(robot, hulls, ()) is hulls
