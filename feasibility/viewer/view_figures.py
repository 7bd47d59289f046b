"""Views as flat figures: one with its legend, or several as small pictures side by side."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from feasibility.viewer.figures import DOTS_PER_INCH, Plot, plain
from feasibility.viewer.html_page import Legend

WIDTH = 90  # characters of a line above a picture


class Drawn(Protocol):
    """A view, or whatever else has a picture and a legend."""

    @property
    def legend(self) -> Legend:
        """Title, text and entries."""

    def image(self, width: int = ..., height: int = ...) -> Any:
        """The picture, (height, width, 3)."""


def plot_view(view: Drawn) -> Plot:
    """The picture of a view, painted without a browser, with its title and its legend."""
    from matplotlib.patches import Patch

    figure = Plot(figsize=(7.6, 5.7), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(view.image(), interpolation="lanczos")
    axes.set_axis_off()
    lines = [textwrap.fill(line, WIDTH) for line in (view.legend.title, view.legend.checked)]
    figure.suptitle(plain("\n".join(lines)), fontsize=11)
    shown = [entry for entry in view.legend.entries if entry.shown]
    handles = [Patch(color=entry.colour, label=plain(entry.label)) for entry in shown]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure


def small_png(figure: Plot) -> bytes:
    """A figure as PNG of 256 colours, rare ones too: notebooks keep many of them."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    figure.set_dpi(DOTS_PER_INCH)
    canvas, stream = FigureCanvasAgg(figure), io.BytesIO()
    canvas.draw()  # `savefig` draws twice
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    image.quantize(256, Image.Quantize.MAXCOVERAGE).save(stream, format="png", optimize=True)
    return stream.getvalue()


def plot_views(views: Mapping[str, Drawn], columns: int = 4) -> Plot:
    """Several views as one figure of small pictures, each below its title.

    Args:
        views: by their titles.
        columns: pictures side by side.
    """
    rows = -(-len(views) // columns)
    figure = Plot(figsize=(3.1 * columns, 3.0 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, (title, view) in zip(grid.flat, views.items(), strict=False):
        axes.imshow(view.image(360, 300), interpolation="lanczos")
        axes.set_title(plain(title), fontsize=9)
    return figure
