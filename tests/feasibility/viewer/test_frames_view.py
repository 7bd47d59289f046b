"""A frame on each cell where the tool is held otherwise than by the normal alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fabricated import DOME, TASK, verdict_on

from feasibility.viewer import scene
from robots import load_robot


@pytest.fixture(scope="module")
def verdict():
    return verdict_on(load_robot("puma560"), DOME.cells(3, 4))


def lines(layer):
    """(k, 2, 3) m, the ends of the segments of a part of the picture."""
    (command,) = layer.commands
    position = command["object"]["geometries"][0]["data"]["attributes"]["position"]
    return np.frombuffer(position["array"].data, "<f4").reshape(-1, 2, 3)


def test_frames_show_approach_and_reference_at_the_targets(verdict):
    task = replace(TASK, roll_deg=(-15, 30), approach=(0, 0.5, -1))
    verdict = replace(verdict, task=task)
    shown = {layer.entry.label: layer for layer in scene.layers(verdict)}
    targets = task.targets(verdict.cells)
    approach = lines(shown["approach directions"])
    reference = lines(shown["roll 0 (allowed -15 to 30 deg)"])
    assert np.allclose(approach[:, 1], targets.points, atol=2e-5)
    assert np.allclose(reference[:, 0], targets.points, atol=2e-5)
    for found, right in ((approach, targets.approaches), (reference, targets.references)):
        along = np.diff(found, axis=1)[:, 0]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        assert np.allclose(along, right, atol=1e-3)


def test_without_limits_there_are_none(verdict):
    names = {layer.entry.label for layer in scene.layers(verdict)}
    assert not any("roll" in name or "approach" in name for name in names)
