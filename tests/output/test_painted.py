"""The picture painted without a browser: what is in it, where, and what hides what."""

import base64
import io
import sys

import matplotlib as mpl
import numpy as np
import pytest
from made_up import missing
from PIL import Image

from coverable import check, load_case, plot_graph, plot_views, view
from feasibility.viewer import threejs
from feasibility.viewer.html_page import Camera
from feasibility.viewer.painter import LENS, painted

SIZE = (160, 120)
EYE = (4.0, 0.0, 0.0)
FRONT = Camera((0.0, 0.0, 0.0), EYE, zoom=2.0)  # right is +y, up is +z
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
SQUARE = np.array([[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]], dtype=float)
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def square(path, colour, size=0.5, x=0.0, **looks):
    """A square across the view, `size` m from middle to side, at a distance of 4 - x m."""
    return threejs.mesh_object(path, size * SQUARE + [x, 0, 0], HALVES, colour, lit=False, **looks)


def mask(image, colour):
    return np.abs(image - colour).max(axis=2) < 0.02


def test_a_square_is_where_the_lens_puts_it() -> None:
    image = painted([square("/a", RED)], FRONT, *SIZE)
    assert image.shape == (120, 160, 3)
    rows, columns = np.nonzero(mask(image, RED))
    side = 0.5 / 4.0 / (LENS / 2.0) * 60  # pixels from the middle
    assert abs(rows.min() - (60 - side)) <= 1.0
    assert abs(rows.max() + 1 - (60 + side)) <= 1.0
    assert abs(columns.min() - (80 - side)) <= 1.0
    assert abs(columns.max() + 1 - (80 + side)) <= 1.0


@pytest.mark.parametrize("order", [1, -1])
def test_what_is_nearer_hides_what_is_behind(order) -> None:
    image = painted([square("/far", RED), square("/near", BLUE, x=1.0)][::order], FRONT, *SIZE)
    assert not mask(image, RED).any()
    assert mask(image, BLUE).sum() > 500
    glass = square("/near", BLUE, 1.0, x=1.0, opacity=0.5)
    image = painted([glass, square("/far", RED)][::order], FRONT, *SIZE)
    assert mask(image, (0.5, 0.0, 0.5)).sum() > 500
    hidden = threejs.set_property("/a", "visible", False)
    out = [square("/a/b", RED), square("/behind", RED, x=5.0), hidden]
    assert (painted(out, FRONT, *SIZE) == painted([], FRONT, *SIZE)).all()
    line = threejs.segments("/line", np.array([[0, -0.4, 0.0], [0, 0.4, 0.0]]), GREEN)
    assert mask(painted([square("/a", RED), line], FRONT, *SIZE), GREEN).sum() > 20
    assert not mask(painted([square("/a", RED, x=1.0), line], FRONT, *SIZE), GREEN).any()


def test_a_view_leaves_a_picture_beside_the_page() -> None:
    """It holds the arm, the missed cells and the edges; matplotlib is left alone."""
    before, pyplot = dict(mpl.rcParams), "matplotlib.pyplot" in sys.modules
    dome = check(*load_case("paper/4a", ["surface.cells=[4, 5]"]).build())
    drawn = view(missing(dome, {5, 6, 13}), play=False)
    bundle = drawn._repr_mimebundle_()
    with Image.open(io.BytesIO(base64.b64decode(bundle["image/png"]))) as image:
        pixels = np.asarray(image.convert("RGB"), dtype=int)
    red, green, blue = np.moveaxis(pixels, -1, 0)
    assert ((blue > 180) & (red < 90) & (green < 120)).sum() > 200, "edges of G"
    assert ((red > 110) & (green < 60) & (blue < 90)).sum() > 200, "cells out of reach"
    assert ((green > 1.5 * red) & (green > 1.5 * blue)).sum() > 10, "the start"
    assert ((red > 1.5 * green) & (red > 1.5 * blue) & (red > 150)).sum() > 5, "the x axis"
    assert len(bundle["image/png"]) < 150_000, "notebooks keep many"
    figure = plot_views({"one": drawn, "two: $x$": drawn, "three": drawn}, columns=2)
    titles = [axes.get_title() for axes in figure.axes if axes.images]
    assert titles == ["one", r"two: \$x\$", "three"]
    assert plot_graph(dome)._repr_png_().startswith(b"\x89PNG")
    assert dict(mpl.rcParams) == before
    assert ("matplotlib.pyplot" in sys.modules) == pyplot
