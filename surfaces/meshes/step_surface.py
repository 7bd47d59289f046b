"""Faces of a STEP file as a surface: chosen by number or by colour, cut into triangles."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints
from coverable.errors import Fault, listed, shown
from coverable.files import shown_name
from surfaces.arguments import ORIGIN, Checks
from surfaces.meshes.cleaning import clean
from surfaces.meshes.mesh_surface import MeshSurface, mesh
from surfaces.meshes.sources import with_likely_unit
from surfaces.meshes.step_process import CAPS, Caps, Read, read_step
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.surface import Side, SurfaceError

DEVIATION = 1e-4  # [m]
COARSE, BLUNT = 5e-4, 0.5  # [m], [rad] in a picture
ANGLE = 0.2  # [rad] between neighbouring triangles: their normals are blended, as of any mesh
LISTED = 20  # faces, or colours, in a message
CHOOSE = 'choose by faces = [3, 7], by faces = "all" or by colour = "#ff0000"'
ALL = "all"
Faces = Sequence[int] | Literal["all"]


class StepFace(NamedTuple):
    """One face of a STEP file."""

    number: int
    """From 1, in the order in which Open CASCADE explores the file, as FreeCAD's Face1, Face2."""
    kind: str
    """Of surface: "plane", "cylinder", "bsplinesurface", ..."""
    area: float
    """m^2."""
    colour: str
    """As "#rrggbb"; empty where the file gives it none."""
    centre: tuple[float, float, float]
    """m, a place on the face near its middle, in the file's frame."""
    normal: tuple[float, float, float]
    """Outward unit normal there; zero where there is none."""


class StepParts(NamedTuple):
    """All faces of a STEP file as triangles."""

    faces: tuple[StepFace, ...]
    vertices: Array
    """(V, 3) m."""
    triangles: Ints
    """(F, 3) corners, counterclockwise seen from outside."""
    owner: Ints
    """(F,) the number of the face that each triangle belongs to."""


def step(
    file: str | os.PathLike[str],
    faces: Faces | None = None,
    colour: str | None = None,
    deviation: float = DEVIATION,
    side: Side = "outside",
    position: ArrayLike = ORIGIN,
    rpy_deg: ArrayLike = ORIGIN,
) -> MeshSurface:
    """A surface of faces of a STEP file, through triangles (extra `coverable[step]`).

    Faces that share an edge get the same points on it, so that cells on both sides of it are
    neighbours. Lengths are metres, whatever the file's unit. How far the triangles lie off the
    faces is measured, and stated in `notes`.

    Args:
        file: its path.
        faces: numbers as `step_faces` gives them, from 1, or "all"; or
        colour: "#rrggbb", of all faces to be taken.
        deviation: m, how far triangles may lie off the faces, about.
        side: 'outside' for a tool on the side that the faces look to, which is outside the solid.
        position: (3,) m, origin of the file's frame in the root frame.
        rpy_deg: (3,) fixed-axis roll, pitch, yaw of the file's frame.

    Raises:
        SurfaceError: the numbers make no sense, the file cannot be read, it has no such face or
            colour, or its faces make no surface.
    """
    check = Checks("step")
    check.pose(side, position, rpy_deg)
    check.done()
    return mesh(step_triangles(file, faces, colour, deviation), 1.0, side, position, rpy_deg)


def step_faces(file: str | os.PathLike[str], caps: Caps = CAPS) -> tuple[StepFace, ...]:
    """The faces of a STEP file, with what tells them apart.

    Raises:
        SurfaceError: the extra is missing, or the file cannot be read.
    """
    name = shown_name(file)
    try:
        return _faces(read_step(file, {"numbers": [], "colour": ""}, caps))
    except SurfaceError as error:
        raise SurfaceError(error.faults, name) from error


def step_triangles(
    file: str | os.PathLike[str],
    faces: Faces | None = None,
    colour: str | None = None,
    deviation: float = DEVIATION,
    caps: Caps = CAPS,
) -> TriangleMesh:
    """The triangles of faces of a STEP file; arguments as of `step`.

    Raises:
        SurfaceError: as `step`.
    """
    numbers, wanted = checked_choice(faces, colour, deviation)
    name = shown_name(file)
    job = {"numbers": numbers, "colour": wanted, "deviation": deviation, "angle": ANGLE}
    try:
        read = read_step(file, job, caps)
        _refuse_missing(read, numbers, wanted, faces is not None or colour is not None)
        return with_likely_unit(clean(read.vertices, read.triangles, [_note(read)]))
    except SurfaceError as error:
        raise SurfaceError(error.faults, name) from error


def step_parts(file: str | os.PathLike[str], caps: Caps = CAPS) -> StepParts:
    """All faces of a STEP file, each with its triangles, for a picture.

    Raises:
        SurfaceError: as `step`.
    """
    job = {"numbers": ALL, "colour": "", "deviation": COARSE, "angle": BLUNT}
    try:
        read = read_step(file, job, caps)
    except SurfaceError as error:
        raise SurfaceError(error.faults, shown_name(file)) from error
    owner = np.repeat(np.array(read.taken, dtype=np.int64), read.counts)
    return StepParts(_faces(read), read.vertices, read.triangles, owner)


def checked_choice(
    faces: Faces | None = None, colour: str | None = None, deviation: float = DEVIATION
) -> tuple[list[int] | Literal["all"], str]:
    """Which faces are meant: their numbers or all, and the colour in small letters.

    Raises:
        SurfaceError: the arguments make no sense, or contradict each other.
    """
    check = Checks("step")
    check.number("deviation", deviation, "must be a number in 1e-06 .. 0.1 (metres)", 1e-6, 0.1)
    numbers: list[int] | Literal["all"] = []
    if isinstance(faces, str) and faces == ALL:
        numbers = "all"
    elif faces is not None:
        given: Any = faces.tolist() if isinstance(faces, np.ndarray) else faces
        if isinstance(given, Sequence) and not isinstance(given, str) and given:
            numbers = [check.whole(f"faces[{k}]", one, 1, 10**9) for k, one in enumerate(given)]
        else:
            check.wrong("faces", faces, 'must be an array of numbers of faces, from 1, or "all"')
    wanted = ""
    if colour is not None:
        if isinstance(colour, str) and re.fullmatch("#[0-9a-fA-F]{6}", colour):
            wanted = colour.lower()
        else:
            check.wrong("colour", colour, 'must be a colour as "#rrggbb", such as "#ff0000"')
        if faces is not None:
            check.keep(Fault("colour", "contradicts faces; give one of the two"))
    check.done()
    return numbers, wanted


def _refuse_missing(
    read: Read, numbers: list[int] | Literal["all"], colour: str, chosen: bool
) -> None:
    """Refuse faces that are not there.

    Raises:
        SurfaceError: there are such, or none were asked for; with a list of those there are.
    """
    count = len(read.faces)
    if not chosen:
        raise SurfaceError(f"{CHOOSE}; `coverable show` shows them: {_listed(read)}")
    own = [] if numbers == "all" else numbers
    beyond = [k for k, number in enumerate(own) if number > count]
    if beyond:
        what = f"names face {own[beyond[0]]}; the file has {_listed(read)}"
        raise SurfaceError(Fault(f"faces[{beyond[0]}]", what))
    if colour and not read.taken:
        there = sorted({face["colour"] for face in read.faces} - {""})
        remedy = f"there are {listed(there, LISTED)}"
        if not there:
            remedy = f"none of its {count} faces has one; choose by faces = [3, 7]"
        raise SurfaceError(Fault("colour", f"is {shown(colour)}, which no face has; {remedy}"))


def _listed(read: Read) -> str:
    """How many faces there are, and what the largest of them are."""
    faces = sorted(_faces(read), key=lambda face: -face.area)[:LISTED]
    words = [face_words(face) for face in sorted(faces)]
    largest = f", the {LISTED} largest" if len(read.faces) > LISTED else ""
    plural = "face" if len(read.faces) == 1 else f"faces, 1 .. {len(read.faces)}"
    return f"{len(read.faces)} {plural}{largest} ({'; '.join(words)})"


def face_words(face: StepFace) -> str:
    """A face with what tells it apart.

    Example:
        >>> face_words(StepFace(3, "plane", 0.02, "#ff0000", (0.1, 0.05, 0.0), (0.0, -0.0, -1.0)))
        '3: plane, 0.02 m^2, #ff0000, at 0.1, 0.05, 0 m, looks to 0, 0, -1'
    """
    centre, normal = (
        ", ".join(f"{round(value, digits) + 0.0:g}" for value in vector)
        for vector, digits in ((face.centre, 4), (face.normal, 2))
    )
    colour = f", {face.colour}" if face.colour else ""
    words = f"{face.number}: {face.kind}, {face.area:.3g} m^2{colour}, at {centre} m"
    return f"{words}, looks to {normal}" if any(face.normal) else words


def _note(read: Read) -> str:
    """What stands for the faces, and how far off."""
    faces = read.taken
    shown_faces = listed(faces, LISTED)
    which = f"face {shown_faces}" if len(faces) == 1 else f"{len(faces)} faces ({shown_faces})"
    count = len(read.triangles)
    return f"{count:,} triangles stand for {which}, at most {read.deviation * 1e3:.2g} mm off"


def _faces(read: Read) -> tuple[StepFace, ...]:
    return tuple(StepFace(k + 1, **face) for k, face in enumerate(read.faces))
