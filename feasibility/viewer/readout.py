"""What is read beside the time slider: joint values, distance and angle of the tool, clearance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coverable.arrays import Array
from feasibility.viewer.html_page import Readout
from feasibility.viewer.playback import Playback, key_times
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells


def readout_of(robot: Robot, cells: Cells, motion: Playback) -> Readout:
    """The values of a motion at its key frames, between which the page interpolates.

    The distance is that of the tool point from the surface on its working side (mm), the angle
    the one between the tool axis and the normal there (deg).

    Args:
        robot: the arm.
        cells: what it works on.
        motion: what the view plays.
    """
    times = key_times(motion)
    q = motion.at(times)
    slides = robot.prismatic
    values = q * np.where(slides, 1e3, 180.0 / np.pi)
    units = ["mm" if each else "deg" for each in slides.tolist()]
    names, columns = list(robot.joint_names), list(values.T)
    if len(cells):
        names, units = [*names, "distance", "angle"], [*units, "mm", "deg"]
        columns += [*distance_and_angle(robot, cells, q)]
    rows = zip(names, units, [np.round(column, 2).tolist() for column in columns], strict=True)
    return Readout(tuple(np.round(times, 4).tolist()), tuple(rows), motion.there_and_back)


def with_nearest(readout: Readout, distances: list[float], names: tuple[str, ...]) -> Readout:
    """The same with the distance of the nearest pair of bodies, and who they are.

    Args:
        readout: the other values.
        distances: mm, at each of its times.
        names: the pair at each of its times.
    """
    rows = (*readout.rows, ("clearance", "mm", distances))
    return replace(readout, rows=rows, nearest=names)


def distance_and_angle(robot: Robot, cells: Cells, q: Array) -> Array:
    """(2, k): mm from the surface on its working side, and degrees from the normal there."""
    points, axes = Kinematics(robot).tools(q)
    closest = cells.surface.closest(points)
    side = cells.surface.side_sign
    cosine = -side * (axes * closest.normal).sum(axis=1)  # the tool points at the surface
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return np.stack([1e3 * side * closest.height, angle])
