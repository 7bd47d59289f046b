"""coverable: the same poses in their order, and the square as a surface of 90 cells."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from squares import COLUMNS, LINE, ROWS, TILT_DEG, TIP, Floats, Square

from feasibility import Task, check
from robots import load_robot
from surfaces import plane, poses

PACKAGE = "coverable"


def _asked(square: Square) -> Task:
    if square.fixed:
        return Task(0.0, 0.0, tolerance=LINE, roll_deg=(0.0, 0.0), roll_reference=(1.0, 0.0, 0.0))
    return Task(0.0, TILT_DEG, tolerance=LINE)


def prepare(
    square: Square, urdf: str, in_order: bool = True
) -> Callable[[], tuple[str, Floats | None]]:
    """What answers the question; `in_order` along the poses, else over the surface in any order."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(urdf)
        robot = load_robot(path, tool_frame=TIP)
    if in_order:
        points = square.points()
        up, along = (np.tile(axis, (len(points), 1)) for axis in ([0.0, 0, 1], [1.0, 0, 0]))
        cells = poses(points, up, tangents=along)
    else:
        half = 0.5 * square.side
        cells = plane((-half, half), (-half, half), "outside", square.centre).cells(ROWS, COLUMNS)
    task = _asked(square)

    def answer() -> tuple[str, Floats | None]:
        verdict = check(robot, cells, task)
        said = f"{verdict.answer} ({verdict.evidence}), {verdict.n_covered} of 90"
        return said, None if verdict.witness is None else verdict.witness.q

    return answer
