"""Faces of a STEP file in their colours, each with its number, border, and line of the legend."""

from __future__ import annotations

import numpy as np
from numpy.linalg import norm

from coverable.arrays import Array
from coverable.errors import counted
from feasibility.viewer import threejs
from feasibility.viewer.html_page import Entry, Legend, page
from feasibility.viewer.meshes import GREY, tubes
from feasibility.viewer.pass_view import digit_lines
from feasibility.viewer.stage import BACKDROP, framing, triad
from feasibility.viewer.verdict_scene import OUTLINES
from surfaces.meshes.step_surface import StepFace, StepParts
from surfaces.passes.welded_triangles import border_edges

MOST_LINES = 40  # of the legend, the largest faces
TALL, SMALLEST, LARGEST = 0.5, 0.03, 0.1  # [1] a digit, of a face's width; of the whole part
MANY = 20  # faces, with more of which the smallest digits are smaller still
OFF = 0.006  # [1] of the part: numbers stand off their faces
THICK = 0.06  # [1] of a digit's height
INK: threejs.Colour = (0.0, 0.0, 0.0)
VIEWED = np.array([0.55, -0.70, 0.45]) / norm([0.55, -0.70, 0.45])  # from the part to the eye


def faces_page(parts: StepParts, name: str) -> str:
    """A page that shows the faces of a file.

    Args:
        parts: the faces with their triangles.
        name: of the file.
    """
    points = parts.vertices
    size = float(norm(np.ptp(points, axis=0)))
    smallest = SMALLEST * size / max(1.0, len(parts.faces) / MANY) ** 0.5
    largest = {
        face.number for face in sorted(parts.faces, key=lambda face: -face.area)[:MOST_LINES]
    }
    commands = [*BACKDROP, triad("/frame", np.eye(4), 0.2 * size)]
    entries = []
    for face in parts.faces:
        own = parts.triangles[parts.owner == face.number]
        used, corners = np.unique(own, return_inverse=True)
        path, colour = f"/faces/{face.number}", _colour(face)
        triangles = corners.reshape(-1, 3)
        commands.append(threejs.mesh_object(path, points[used], triangles, colour))
        if face.number in largest:
            label = f"{face.number}: {face.kind}, {face.area:.3g} m^2"
            entries.append(Entry(label, colour, path))
        width = face.area / max(float(norm(np.ptp(points[used], axis=0))), 1e-300)
        tall = float(np.clip(TALL * width, smallest, LARGEST * size))
        digits = tubes(_number(face, tall, OFF * size), THICK * tall)
        commands.append(threejs.mesh_object(f"/numbers/{face.number}", *digits, INK, lit=False))
    borders = points[border_edges(parts.triangles)].reshape(-1, 3)
    commands.append(threejs.segments("/borders", borders, OUTLINES))
    entries += [Entry("borders", OUTLINES, "/borders"), Entry("numbers", INK, "/numbers")]
    text = 'in a case: faces = [3, 7], faces = "all" or colour = "#ff0000"'
    if len(parts.faces) > MOST_LINES:
        text += f"; below the {MOST_LINES} largest"
    title = f"{name}: {counted(len(parts.faces), 'face')}"
    legend = Legend(title, text, tuple(entries), checked="")
    return page(commands, legend, framing(points, VIEWED))


def _colour(face: StepFace) -> threejs.Colour:
    """That of the file, else grey."""
    if not face.colour:
        return GREY
    red, green, blue = (int(face.colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    return red, green, blue


def _number(face: StepFace, tall: float, off: float) -> list[Array]:
    """The number of a face as lines before its middle, upright where it can be.

    Args:
        face: the face.
        tall: m, a digit.
        off: m, from the face.
    """
    normal = np.array(face.normal) if any(face.normal) else VIEWED
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else -VIEWED * [1.0, 1.0, 0.0]
    up = up - (up @ normal) * normal
    up = up / norm(up)
    along = np.cross(up, normal)
    return digit_lines(face.number, np.array(face.centre) + off * normal, along, tall * up)
