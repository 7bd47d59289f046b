"""Cone and roll of a task: the angles that count, against the referee and by hand."""

import numpy as np
import plain
import pytest
import referee
from asked import question, verdict_of

from coverable import Task, coverage_path, divide, plane, verify
from feasibility.roll import projected, roll_of


def test_the_roll_is_the_angle_after_the_least_rotation_onto_the_approach():
    rng = np.random.default_rng(0)
    axes, b, given = (referee.unit(rng.normal(size=(200, 3))) for _ in range(3))
    across = referee.unit(np.cross(axes, rng.normal(size=(200, 3))))
    references, sines = projected(given, b)
    assert np.abs((references * b).sum(axis=1)).max() < 1e-12
    np.testing.assert_allclose(sines, np.linalg.norm(np.cross(given, b), axis=1), atol=1e-12)
    there = referee.roll_about(across, axes, given, b)
    apart = roll_of(across, axes, references, b) - there
    assert np.abs((apart + np.pi) % (2 * np.pi) - np.pi).max() < 1e-6
    turned = referee.about(b[0], np.array([0.3]))[0]  # a turn about the approach adds to it
    more = referee.roll_about(
        (turned @ across[0])[None], (turned @ axes[0])[None], given[:1], b[:1]
    )
    assert (more - there[:1] - 0.3 + np.pi) % (2 * np.pi) - np.pi == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("given", "cone_deg", "kept", "cone"), [
    ((-15, 15), 20, (0.0, 15.0), 20.0), ((60, 70), 20, (65.0, 5.0), 20.0),
    ((-100, 100), 20, (0.0, 100.0), 20.0),
    ((0, 0), 0, (0.0, 0.1), 0.1),  # fixed: a tenth of a degree
    ((-360, -360), 20, (-360.0, 0.1), 20.0), ((0, 5), 0, (2.5, 2.5), 0.0),
    ((-180, 180), 20, None, 20.0), (None, 0, None, 0.0),
])  # fmt: skip
def test_ranges_of_the_roll(given, cone_deg, kept, cone):
    task = Task(0.005, cone_deg, roll_deg=given)
    found = None if task.roll is None else tuple(np.degrees(task.roll))
    if kept is None:
        assert found is None
    else:
        off = (found[0] - kept[0] + 180.0) % 360.0 - 180.0
        assert (off, found[1]) == (pytest.approx(0.0, abs=0.11), pytest.approx(kept[1]))
    assert task.cone_deg == cone


@pytest.mark.parametrize(("cone_deg", "holds"), [(120, False), (149, False), (180, True)])
def test_a_wide_cone_is_no_free_axis(cone_deg, holds):
    """The tool over a plate, judged against one that looks the other way: a tilt of 150 or more."""
    verdict = verdict_of("plate")
    away = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.34), side="inside").cells(3, 4)
    asked = question("plate")
    assert verify(asked.robot, away, Task(0.02, cone_deg), verdict.witness.q).holds == holds


def test_paths_and_patches_keep_to_the_roll():
    """What other questions make of a verdict is held to the same range."""
    verdict = verdict_of("a square and 15 degrees")
    walk = coverage_path(verdict, "columns").walk
    assert plain.faults_of(verdict, walk.q, walk.cell) == []
    division = divide(verdict.robot, verdict.cells, verdict.task)
    assert [p.certificate.max_roll <= np.radians(15) for p in division.patches] == [True]
