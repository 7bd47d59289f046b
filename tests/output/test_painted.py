"""The picture painted without a browser: what is in it."""

import base64
import io
import sys

import matplotlib as mpl
import numpy as np
from made_up import missing
from PIL import Image

from coverable import check, load_case, plot_graph, plot_views, view


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
