"""The larger part of what `make test` tries a sample of."""

import pytest
import test_division
import test_explain
import test_robot_visuals
import test_segment_bound
import test_set_cover


@pytest.mark.parametrize(("arm", "number"), test_division.DRAWN)
def test_divisions(arm, number):
    test_division.test_random_cases(arm, number)


@pytest.mark.parametrize("block", range(20))
def test_tables_against_brute_force(block):
    test_set_cover.test_random_tables_against_brute_force(block)
    test_set_cover.test_the_programme_alone_against_brute_force(block)


@pytest.mark.parametrize("kind", test_segment_bound.KINDS)
def test_segments(kind):
    test_segment_bound.assert_accepted_segments_hold(kind, 100)
    test_segment_bound.assert_roll_holds(kind, 100)
    test_segment_bound.assert_the_cone_holds(kind, 100)


@pytest.mark.parametrize("name", test_explain.MORE)
def test_sides(name):
    test_explain.test_what_is_said_of_a_side_is_what_a_verdict_says(name)


@pytest.mark.parametrize("name", test_robot_visuals.LARGE)
def test_large_visuals(name):
    test_robot_visuals.test_every_link_with_visuals_is_drawn_whole_and_within_its_own_shape(name)
