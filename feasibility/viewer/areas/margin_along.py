"""The margin along a motion: how far the part may be shifted while the tool is where."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from feasibility.verdict import Verdict
from feasibility.viewer.cell_meshes import cell_size, marks
from feasibility.viewer.threejs import Colour
from feasibility.viewer.verdict_scene import Layer, hidden, lines_layer, mesh_layer
from robots.kinematics import Kinematics

BANDS: tuple[tuple[float, Colour], ...] = (
    (1.5, (0.84, 0.12, 0.12)),
    (3.0, (0.90, 0.60, 0.00)),
    (np.inf, (0.00, 0.62, 0.45)),
)
"""Times the least margin, up to which the path has a colour."""
LEAST: Colour = (0.84, 0.12, 0.12)
MARK = 0.1  # [1] of a cell's width, of the mark where the margin is least


def margin_layers(verdict: Verdict) -> Iterator[Layer]:
    """The tool's path in colours, by how far the part may be shifted there, and the least place."""
    margin = None if verdict.certificate is None else verdict.certificate.placement_margin
    if margin is None or margin.along is None or verdict.witness is None:
        return
    points = Kinematics(verdict.robot).tools(verdict.witness.q)[0]
    ends, low = np.stack([points[:-1], points[1:]], axis=1), 0.0
    for times, colour in BANDS:
        high = times * float(margin.along.min())
        some = (margin.along >= low) & (margin.along < high)
        if some.any():
            to = f"{1e3 * low:.3g} mm and more" if high == np.inf else f"up to {1e3 * high:.3g} mm"
            label, path = f"tool path: the part may be off {to}", f"/margin/{times:g} times"
            yield hidden(lines_layer(label, colour, path, ends[some]))
        low = high
    least = ends[[int(np.argmin(margin.along))]].mean(axis=1)
    dot = marks(least, MARK * cell_size(verdict.cells))
    yield mesh_layer("least room for the part", LEAST, "/margin/least", *dot, lit=False)
