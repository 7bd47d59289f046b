"""Parallel passes over a surface, at a stated distance from one another."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Mask
from coverable.errors import ArgumentError, Checks, counted
from surfaces.passes.first_pass import Field, distance_field, plane_field
from surfaces.passes.holes import Lidded, with_lids
from surfaces.passes.levels import Line, level_lines
from surfaces.passes.pass_stretches import LevelLine, Pass, in_order, stretch_of
from surfaces.passes.triangulation import WorkingCopy, working_copy, working_mesh
from surfaces.passes.welded_triangles import WorkingMesh
from surfaces.patches.patch import Patch
from surfaces.surface import Surface

By = Literal["distance", "planes", "parameters"]
BYS: tuple[By, ...] = ("distance", "planes", "parameters")
EDGES_PER_PITCH = 4.0  # how fine distances are measured
POINTS_PER_PITCH = 4.0  # how close the points of a pass are, by default
SHORTEST = 0.5  # [1] of the spacing: shorter pieces are dropped, by default
TURNED = math.radians(1.0)  # passes further from the requested direction than this get a note
KINK = 0.9  # [1] a distance that grows more slowly than this across a face has a ridge there


@dataclass(frozen=True, eq=False, slots=True)
class Passes:
    """Passes over a surface, in the order and the directions in which they are to be run."""

    surface: Surface
    stretches: tuple[Pass, ...]
    pitch: float
    """m, as requested."""
    spacing: float
    """m, the distance between passes: the pitch, or less, so that they are evenly spread."""
    by: By
    widest: float
    """m, the largest distance between neighbouring passes, on the surface: for `distance` the
    spacing, for planes and parameters more where the surface slopes away from them."""
    dropped: float
    """m, total length of stretches that were too short to run."""
    notes: tuple[str, ...]
    """What a user should know: holes, kinks, one sentence each."""

    @property
    def count(self) -> int:
        """How many passes there are; one that a hole parts in two counts once."""
        return len({each.level for each in self.stretches})

    @property
    def length(self) -> float:
        """m, of all passes together, overrun included."""
        return sum(each.length for each in self.stretches)

    @property
    def beyond_border(self) -> float:
        """m, how far passes go on beyond the border, at most."""
        return max((each.beyond_border for each in self.stretches), default=0.0)


def parallel_passes(
    surface: Surface,
    pitch: float,
    direction: float | ArrayLike = 0.0,
    *,
    by: By = "distance",
    overrun: float = 0.0,
    step: float | None = None,
    shortest: float | None = None,
    one_way: bool = False,
) -> Passes:
    """Parallel passes over a surface.

    By `distance`, every point of a pass has its neighbour at the spacing, measured on the surface
    (Atkar et al., "Uniform coverage of automotive surface patches", 2005). Section `planes` keep it
    along straight lines in space, so the passes are further apart where the surface slopes;
    `parameters` are lines of constant u or v.

    Args:
        surface: what is to be covered.
        pitch: m > 0, the largest distance between passes.
        direction: of the passes at the middle of the surface: an angle (rad) in the surface, from
            the u direction of a patch or the projected x axis of a mesh's frame, counterclockwise
            seen from outside; or a vector (3,) in the root frame, which is projected. With
            `parameters`, 0 runs along u and pi / 2 along v.
        by: how distance is measured.
        overrun: m >= 0, by how much passes go on straight beyond the border.
        step: m > 0 between points of a pass; a quarter of the pitch by default.
        shortest: m >= 0, stretches shorter than this are dropped; half of the spacing by default.
        one_way: run all passes in the same direction, not to and fro.

    Raises:
        ArgumentError: a number is out of its range, the direction is along the normal, or
            the surface has no `parameters`.
        SurfaceError: passes over a surface of this kind are not supported.

    Example:
        >>> from coverable import plane
        >>> from coverable import parallel_passes
        >>> found = parallel_passes(plane((0, 0.6), (0, 0.4)), 0.03)
        >>> found.count, round(found.spacing, 6), round(found.length, 3)
        (14, 0.028571, 8.4)
    """
    _check(pitch, overrun, step, shortest, by)
    edge = pitch / EDGES_PER_PITCH
    copy = working_copy(surface, working_mesh(surface, edge))
    lidded = with_lids(copy.mesh, edge)
    found = pass_lines(surface, lidded, direction, by, pitch)
    field, spacing = found.field, found.spacing
    kept = SHORTEST * spacing if shortest is None else shortest
    lines, dropped = list[LevelLine](), 0.0
    for each in found.lines:
        if each.line.length >= kept:
            lines.append(each)
        else:
            dropped += each.line.length
    apart = step or pitch / POINTS_PER_PITCH
    return Passes(
        surface=surface,
        stretches=tuple(
            stretch_of(surface, each, apart, overrun) for each in in_order(lines, one_way)
        ),
        pitch=float(pitch),
        spacing=spacing,
        by=by,
        widest=spacing / _least_slope(field, lines, by),
        dropped=dropped,
        notes=(*_notes(lidded.holes, lines, field, by), *_direction_note(found), *_copy_note(copy)),
    )


class PassLines(NamedTuple):
    """Lines over a surface, not yet in the order in which they are run."""

    field: Field
    lines: list[LevelLine]
    levels: int
    """How many there are."""
    spacing: float
    """m, between levels."""
    turned: float
    """rad, from the requested direction at the middle to that of the lines."""


def pass_lines(
    surface: Surface, lidded: Lidded, direction: float | ArrayLike, by: By, pitch: float
) -> PassLines:
    """The lines of all levels, cut at holes; for the arguments see `parallel_passes`."""
    mesh = lidded.mesh
    own = WorkingMesh(mesh.vertices, mesh.faces[: lidded.faces])
    centres = mesh.vertices[own.faces].mean(axis=1)
    mean = np.average(centres, axis=0, weights=own.areas)
    middle = centres[np.linalg.norm(centres - mean, axis=1).argmin()]
    normal = surface.closest(middle).normal
    along, turned = _along(surface, middle, normal, direction), 0.0
    if by == "parameters":
        field, turned = _parameter_field(surface, mesh, along, middle)
    else:
        across = np.cross(normal, along)
        field = (distance_field if by == "distance" else plane_field)(mesh, middle, across)
    covers = field.parent < lidded.faces
    levels, spacing = _levels(field, covers, pitch)
    return PassLines(field, list(_lines(field, covers, levels)), len(levels), spacing, turned)


def _check(
    pitch: float, overrun: float, step: float | None, shortest: float | None, by: By
) -> None:
    """Refuse numbers that describe no passes, all of them at once."""
    checks = Checks("passes")
    checks.positive("pitch", pitch, "metres")
    checks.number("overrun", overrun, "must be a finite number >= 0 (metres)", low=0.0)
    if step is not None:
        checks.positive("step", step, "metres")
    if shortest is not None:
        checks.number("shortest", shortest, "must be a finite number >= 0 (metres)", low=0.0)
    checks.choice("by", by, BYS)
    checks.done()


def _along(surface: Surface, middle: Array, normal: Array, direction: float | ArrayLike) -> Array:
    """(3,) unit, the direction of the passes at the middle, in the tangent plane."""
    if np.ndim(direction) == 0:
        angle = float(np.asarray(direction, dtype=float))
        if not math.isfinite(angle):
            raise ArgumentError(f"direction: must be a finite angle (rad), got {direction!r}")
        u = _u_direction(surface, middle, normal)
        return np.asarray(math.cos(angle) * u + math.sin(angle) * np.cross(normal, u))
    vector = np.asarray(direction, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ArgumentError(
            f"direction: must be an angle (rad) or a vector (x, y, z), got {direction!r:.60}"
        )
    flat = vector - (vector @ normal) * normal
    if not np.linalg.norm(flat) > 1e-6 * np.linalg.norm(vector):
        raise ArgumentError(
            f"direction: {vector.tolist()} is along the surface's normal at its middle, "
            f"{np.round(normal, 3).tolist()}; take a direction in the surface"
        )
    return np.asarray(flat / np.linalg.norm(flat))


def _u_direction(surface: Surface, middle: Array, normal: Array) -> Array:
    """(3,) unit, what an angle of 0 means at the middle of the surface."""
    if isinstance(surface, Patch):
        at = surface.closest(middle)
        found = surface.tangent(at.u, at.v)
        if np.linalg.norm(found) > 0.5:
            return np.asarray(found)
    for axis in surface.rotation.T:
        flat = axis - (axis @ normal) * normal
        if np.linalg.norm(flat) > 0.1:
            break
    return np.asarray(flat / np.linalg.norm(flat))


def _parameter_field(
    surface: Surface, mesh: WorkingMesh, along: Array, middle: Array
) -> tuple[Field, float]:
    """The parameter that is constant along the passes, as metres across them at the widest.

    And the angle (rad) from `along` to the passes at the middle.
    """
    if not isinstance(surface, Patch):
        raise ArgumentError(
            f"by: a surface of kind {surface.kind!r} has no lines of constant parameters; take "
            "'distance' or 'planes'"
        )
    at, here = surface.closest(mesh.vertices), surface.closest(middle)
    cosine = min(1.0, abs(float(along @ surface.tangent(here.u, here.v))))
    runs_along_u = cosine > math.sqrt(0.5)
    low, high = surface.v_range if runs_along_u else surface.u_range
    values = ((at.v if runs_along_u else at.u) - low) / (high - low)
    field = Field(mesh, values, np.arange(len(mesh.faces)))
    slopes = field.slopes[~field.torn]
    width = 1.0 / float(slopes[slopes > 0.0].min())
    turned = math.acos(cosine) if runs_along_u else math.asin(cosine)
    return field._replace(values=width * values, extent=(0.0, width)), turned


def _levels(field: Field, own: Mask, pitch: float) -> tuple[Array, float]:
    """Where the passes are, and the spacing (m): half of it at both ends, never over the pitch."""
    values = field.values[field.mesh.faces[own]]
    low, high = field.extent or (float(values.min()), float(values.max()))
    count = max(1, math.ceil((high - low) / pitch - 1e-9))
    spacing = min((high - low) / count, pitch)
    return np.asarray(low + (np.arange(count) + 0.5) * spacing, dtype=float), spacing


def _lines(field: Field, own: Mask, levels: Array) -> Iterator[LevelLine]:
    """Lines of each level, cut where they run over a lid."""
    untorn = ~field.torn
    for number, level in enumerate(levels.tolist()):
        for line in level_lines(field.mesh, field.values, level, untorn):
            for part in _parts(line, own[line.faces]):
                yield LevelLine(number, part)


def _parts(line: Line, own: Mask) -> Iterator[Line]:
    """The parts of a line that run over the surface's own faces."""
    if own.all():
        yield line
        return
    points, faces = line.points, line.faces
    if line.closed:  # begin at a lid, so that no part is cut at the line's first point
        turn = int(np.flatnonzero(~own)[0])
        points = np.roll(points, -turn, axis=0)
        points = np.concatenate([points, points[:1]])
        faces, own = np.roll(faces, -turn), np.roll(own, -turn)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], own.astype(np.int8), [0]])))
    for start, end in ends.reshape(-1, 2):
        yield Line(points[start : end + 1], faces[start:end], closed=False)


def _least_slope(field: Field, lines: list[LevelLine], by: By) -> float:
    """(0, 1] how slowly the field grows across a pass, at the least."""
    faces = np.concatenate([np.zeros(0, int), *(line.faces for _, line in lines)])
    if by == "distance":  # exact, but where a value is that of its neighbours
        faces = faces[field.touched[faces]]
    return max(float(field.slopes[faces].min(initial=1.0)), 1e-9)


def _direction_note(found: PassLines) -> tuple[str, ...]:
    """That passes do not run in the requested direction."""
    if found.turned < TURNED:
        return ()
    return (
        "lines of constant parameters run along u or v, "
        f"{math.degrees(found.turned):.3g} deg from the requested direction",
    )


def _copy_note(copy: WorkingCopy) -> tuple[str, ...]:
    """That distances were measured on a copy."""
    if copy.deviation <= 0.0:
        return ()
    return (
        f"distances are those on a copy of {len(copy.mesh.faces):,} triangles, which is within "
        f"{1e3 * copy.deviation:.2g} mm of the surface; the passes lie on the surface itself",
    )


def _notes(holes: int, lines: list[LevelLine], field: Field, by: By) -> tuple[str, ...]:
    """What to know about the passes."""
    notes = []
    if holes:
        notes.append(f"{counted(holes, 'hole')} parted passes; the tool must lift there")
    if by != "distance" or not lines:
        return tuple(notes)
    if field.mended is not None:
        notes.append(
            f"the exact distance did not reach {len(field.mended):,} of "
            f"{len(field.values):,} vertices, which took theirs from their neighbours; the largest "
            "distance between passes was checked there"
        )
    # Beside the first pass the distance from its vertices is coarse.
    kinked = (field.slopes < KINK) & (field.values[field.mesh.faces] != 0.0).all(axis=1)
    length = sum(float(line.pieces[kinked[line.faces]].sum()) for _, line in lines)
    total = sum(line.length for _, line in lines)
    if length > 0.005 * total:
        notes.append(
            f"passes have kinks over {100.0 * length / total:.1f} % of their length, where paths "
            "to the first pass from two sides meet; another direction may have none"
        )
    return tuple(notes)
