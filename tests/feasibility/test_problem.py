"""What `check` is asked of: cells, and how to come by them from whatever was given instead."""

import numpy as np
import pytest

from feasibility import Task, check
from robots import load_robot
from surfaces import piecewise, plane
from surfaces.meshes import TriangleMesh, mesh

SQUARE = plane((0, 1), (0, 1))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (SQUARE, "surface.cells(9, 10)"),
        (mesh(TriangleMesh(np.eye(3), [[0, 1, 2]])), "surface.cells(count=100)"),
        (piecewise([SQUARE]), "surface.cells([(3, 4)"),
        (lambda u, v: (u, v, 0.0), "parametric(g, u=(0, 1), v=(0, 1)).cells(9, 10)"),
        (lambda u, v: (u, v, 0.0), "mesh(triangles)"),
        (5, "surface.cells(9, 10)"),
        (None, "surface.cells(9, 10)"),
    ],
)
def test_what_is_not_cut_into_cells_is_answered_with_how_to_cut_it(given, words):
    with pytest.raises(TypeError) as caught:
        check(load_robot("puma560"), given, Task(standoff=0.0, cone_deg=30))
    assert words in str(caught.value)
    if "9, 10" not in words and not callable(given):
        assert "cells(9, 10)" not in str(caught.value)


def test_the_ways_to_cut_that_are_named_are_there():
    assert len(mesh(TriangleMesh(np.eye(3), [[0, 1, 2]])).cells(count=100)) >= 1
    two = piecewise([SQUARE, plane((0, 1), (0, 1), position=(1, 0, 0))])
    assert len(two.cells([(3, 4), (3, 4)])) == 24
