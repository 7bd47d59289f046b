"""Are the robot and the cells of a result file still those that are loaded now?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.results.archive import Archive
from feasibility.results.result_fields import Fields
from robots import Robot
from surfaces import Cells

CLOSE = 1e-9  # [m], [1]: tool points, axes, centres and normals that count as the same


def probes(robot: Robot) -> NDArray[np.float64]:
    """(n + 4, 6) numbers that tell one arm from another: limits, tool points and axes.

    The limits fill the first n rows (2 of 6 columns, infinite ones as 0 with a flag beside them);
    tool points and axes at four configurations the rest.
    """
    from robots import Kinematics

    n = robot.n
    low, high = np.clip(robot.lower, -3.0, 3.0), np.clip(robot.upper, -3.0, 3.0)
    limits = np.zeros((n, 6))
    for column, bound in enumerate((robot.lower, robot.upper)):
        limits[:, column] = np.where(np.isfinite(bound), bound, 0.0)
        limits[:, 2 + column] = np.isfinite(bound)
    share = np.modf(0.17 + 0.23 * np.arange(4)[:, None] + 0.31 * np.arange(n))[0]
    points, axes = Kinematics(robot).tools(low + share * (high - low))
    return np.vstack([limits, np.hstack([points, axes])])


def check_robot(robot: Robot, fields: Fields, archive: Archive) -> None:
    """Refuse a robot that is no longer the one that the result was found for."""
    same = fields.get("joints", list, "an array") == list(robot.joint_names)
    if same and fields.text("tool_frame") == robot.tool_frame:
        stored = archive.array("probes", np.float64, (robot.n + 4, 6))
        same = bool(np.abs(stored - probes(robot)).max() <= CLOSE)
    if not same:
        raise archive.error(
            f"was found for another {robot.name!r} than the one that is loaded now (its joints, "
            "limits or geometry have changed); run the check again"
        )


def places(cells: Cells) -> NDArray[np.float64]:
    """(N, 6) centre (m) and outward normal of each cell."""
    return np.hstack([cells.centres, cells.normals])


def check_cells(cells: Cells, label: str, archive: Archive) -> None:
    """Refuse cells that are not the ones that the result was found for.

    A mesh file may have changed since, and so may the way in which surfaces are cut.

    Args:
        cells: as the case makes them now.
        label: what the surface is called.
        archive: the file, with the array `places`.

    Raises:
        ArchiveError: they differ.
    """
    stored = archive.array("places", np.float64, (None, 6))
    if stored.shape != (len(cells), 6):
        how = f"has {len(cells):,} cells now, and had {len(stored):,} then"
    elif len(stored) and np.abs(stored - places(cells)).max() > CLOSE:
        how = "has its cells in other places now"
    else:
        return
    raise archive.error(
        f"was found for another surface than the one that is loaded now: {label} {how}; run the "
        "check again"
    )
