"""Trajectories over all 90 cells of paper cases: what test_timing.py asks of coarse ones."""

import pytest
import test_timing as asked

NAMES = ("4a", "4c", "5c")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "ask",
    [
        asked.test_a_trajectory_is_a_motion_that_the_replay_accepts,
        asked.test_a_controller_that_interpolates_the_samples_keeps_to_all_limits,
        asked.test_samples_keep_to_all_limits,
        asked.test_velocities_and_accelerations_are_the_derivatives_of_positions,
        asked.test_limits_hold_between_samples_too,
    ],
    ids=lambda ask: ask.__name__,
)
def test_the_whole_case(ask, name):
    ask(name)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("degree", [3, 5])
def test_a_controller_stays_on_the_surface(name, degree):
    asked.test_a_controller_that_interpolates_the_samples_stays_on_the_surface(name, degree)
