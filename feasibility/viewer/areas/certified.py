"""Certified tiles tinted on the surface, and the share of the cell under the tool."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from coverable_arrays import Array, Ints
from feasibility.area import percent_down
from feasibility.viewer.cell_meshes import cell_size
from feasibility.viewer.html_page import Entry, Readout
from feasibility.viewer.playback import Playback
from feasibility.viewer.scene import Layer, mesh_layer
from feasibility.viewer.threejs import Colour
from robots import Kinematics, Robot
from surfaces.cell_tiles import cell_tiles
from surfaces.places import Places

if TYPE_CHECKING:
    from feasibility.area import CertifiedArea

CERTIFIED: Colour = (0.00, 0.62, 0.45)
ABOVE = 0.012  # [1] of a cell's width, so that tiles lie over the surface
PIECES = 3  # of a tile's side: a large one is curved


def certified_layer(
    area: CertifiedArea,
    name: str = "certified area",
    share: float | None = None,
    colour: Colour = CERTIFIED,
) -> Layer:
    """The certified tiles, tinted on the side where the tool works.

    Args:
        area: the tiles.
        name: in the legend.
        share: 0 to 1, written beside it; that of all cells' area by default.
        colour: of the tint.
    """
    share = area.share if share is None else share
    cells, path = area.cells, f"/cells/{name}"
    height = cells.surface.side_sign * ABOVE * cell_size(cells)
    cut = cell_tiles(cells, height)
    count, label = len(area.areas), f"{name} ({percent_down(share)})"
    if cut is None or not count:
        return Layer((), Entry(label, colour, path))
    weights, faces = _triangle() if area.tiles.corners.shape[1] == 3 else _square()
    x = np.einsum("wc,kci->kwi", weights, area.tiles.corners).reshape(-1, 2)
    vertices, normals = cut.offset.at(Places(np.repeat(area.tiles.chart, len(weights)), x))
    every = (faces + len(weights) * np.arange(count)[:, None, None]).reshape(-1, 3)
    return mesh_layer(label, colour, path, vertices, every, normals=normals, opacity=0.55)


def _triangle() -> tuple[Array, Ints]:
    """Corners of a triangle as shares of themselves, and its face."""
    return np.eye(3), np.array([[0, 1, 2]])


def _square() -> tuple[Array, Ints]:
    """A grid of places on a rectangle as shares of its corners, and its faces."""
    s, t = (part.ravel() for part in np.meshgrid(*[np.linspace(0.0, 1.0, PIECES + 1)] * 2))
    i, j = (part.ravel() for part in np.meshgrid(*[np.arange(PIECES)] * 2))
    low = i * (PIECES + 1) + j
    right, up = low + 1, low + PIECES + 1
    faces = np.concatenate([np.stack([low, right, up + 1], 1), np.stack([low, up + 1, up], 1)])
    return np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=1), faces


def with_certified_share(
    readout: Readout, robot: Robot, area: CertifiedArea, motion: Playback
) -> Readout:
    """The same values, and how much of the cell under the tool is certified, in percent."""
    points, _ = Kinematics(robot).tools(motion.at(np.array(readout.times)))
    cell = area.cells.locate(points)
    shares = np.where(cell >= 0, area.shares[cell], 0.0)
    row = ("certified", "%", np.round(100.0 * shares, 1).tolist())
    return replace(readout, rows=(*readout.rows, row))
