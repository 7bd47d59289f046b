"""What stands around the arm, and what is mounted on its flange."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict, TypeVar, Unpack, cast

from coverable.arrays import Array
from coverable.errors import ArgumentError, Checks
from feasibility.collisions.shapes import (
    FARTHEST,
    ORIGIN,
    PLACEHOLDER,
    checked_shape,
    read_triangles,
)
from feasibility.collisions.words import SURFACE, TOOL
from robots.poses import matrix_of, rigid_matrix
from robots.shapes.bodies import Geometry, HalfSpace, Triangles
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

Point = Sequence[float]
Path = str | os.PathLike[str]
Made = TypeVar("Made")
CLEAREST = 10.0  # [m], the largest clearance, and the thickest sheet


class Own(TypedDict, total=False):
    """What an object may have of its own."""

    clearance: float | None
    frame: str | None


@dataclass(frozen=True, eq=False, slots=True)
class Obstacle:
    """One object of the scene, at rest in the world, or carried by a link of the arm.

    Raises:
        ArgumentError: it has no name, or its numbers are no body at no place; all that is wrong is
            named. Boxes without thickness, NaN and the like never get further than this.

    Example:
        >>> shelf = Obstacle.box("shelf", (0.5, 0.6, 0.02), position=(0.55, 0.0, 0.5))
        >>> shelf.geometry
        Box(size=(0.5, 0.6, 0.02))
        >>> floor = Obstacle.halfspace("floor", clearance=0.02)
        >>> Obstacle.sphere("ball", radius=0.0, position=(0.0, float("nan"), 0.0))
        Traceback (most recent call last):
        coverable.errors.ArgumentError: obstacle 'ball': 2 faults:
          position must be three finite numbers (metres), got (0.0, nan, 0.0)
          radius must be a finite number > 0 (metres), got 0.0
    """

    name: str
    geometry: Geometry
    placement: Array
    """(4, 4) the object's frame in the world or in the link's frame, m."""
    clearance: float | None = None
    """m, in place of `Collision.clearance` for every pair with it."""
    frame: str | None = None
    """The link that carries it; None for the world."""

    def __post_init__(self) -> None:
        """Refuse what is no body, and keep plain numbers."""
        checks = Checks(f"obstacle {self.name!r}" if isinstance(self.name, str) else "an obstacle")
        if not (isinstance(self.name, str) and self.name.strip() and self.name.isprintable()):
            checks.wrong("name", self.name, "must be a word, by which answers name it")
        elif self.name in (SURFACE, TOOL):
            checks.wrong(
                "name", self.name, "must be another: in pairs it means the surface or the tool"
            )
        if self.frame is not None and not (isinstance(self.frame, str) and self.frame.strip()):
            checks.wrong("frame", self.frame, "must be the name of a link, or None for the world")
        _keep_body(checks, self)
        if self.clearance is not None:
            clearance = checked_distance(checks, "clearance", self.clearance)
            object.__setattr__(self, "clearance", clearance)
        checks.done()

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know about it, one sentence each."""
        if isinstance(self.geometry, Triangles) and not self.geometry.closed:
            return (
                f"The mesh of {self.name!r} is not closed, so it is taken as a sheet: the "
                "arm keeps clear of its faces, but it has no inside.",
            )
        return ()

    @staticmethod
    def box(
        name: str, size: Point, position: Point = ORIGIN, rpy_deg: Point = ORIGIN,
        **own: Unpack[Own],
    ) -> Obstacle:  # fmt: skip
        """A box about its position, with full edge lengths `size` (m).

        Args:
            name: what pairs and answers call it.
            size: (3,) m, along x, y and z of its own frame.
            position: (3,) m, of its middle in the world or in `frame`, as for the other kinds.
            rpy_deg: (3,) fixed-axis roll, pitch, yaw of its frame.
            own: `clearance` and `frame`, see the class.
        """
        return _placed(Obstacle, Box(cast("Any", size)), position, rpy_deg, name=name, **own)

    @staticmethod
    def cylinder(
        name: str, radius: float, length: float, position: Point = ORIGIN, rpy_deg: Point = ORIGIN,
        **own: Unpack[Own],
    ) -> Obstacle:  # fmt: skip
        """A cylinder along z of its own frame, about its position; lengths in m."""
        return _placed(Obstacle, Cylinder(radius, length), position, rpy_deg, name=name, **own)

    @staticmethod
    def sphere(
        name: str, radius: float, position: Point = ORIGIN, rpy_deg: Point = ORIGIN,
        **own: Unpack[Own],
    ) -> Obstacle:  # fmt: skip
        """A ball, m."""
        return _placed(Obstacle, Sphere(radius), position, rpy_deg, name=name, **own)

    @staticmethod
    def capsule(
        name: str, radius: float, length: float, position: Point = ORIGIN, rpy_deg: Point = ORIGIN,
        **own: Unpack[Own],
    ) -> Obstacle:  # fmt: skip
        """A cylinder along z of that length (m), with a half ball on each end."""
        return _placed(Obstacle, Capsule(radius, length), position, rpy_deg, name=name, **own)

    @staticmethod
    def halfspace(
        name: str, position: Point = ORIGIN, rpy_deg: Point = ORIGIN, **own: Unpack[Own]
    ) -> Obstacle:
        """All that is below the xy plane of its own frame: a floor at `position` (m)."""
        return _placed(Obstacle, HalfSpace(), position, rpy_deg, name=name, **own)

    @staticmethod
    def mesh(
        name: str, file: Path, scale: float | None = None, position: Point = ORIGIN,
        rpy_deg: Point = ORIGIN, **own: Unpack[Own],
    ) -> Obstacle:  # fmt: skip
        """The triangles of a file; see `read_triangles` for its formats and its unit."""
        return _placed(Obstacle, (file, scale), position, rpy_deg, name=name, **own)


@dataclass(frozen=True, eq=False, slots=True)
class ToolShape:
    """A shape mounted on the tool frame, for a URDF that ends at the flange.

    Raises:
        ArgumentError: its numbers are no body; all that is wrong is named.

    Example:
        >>> nozzle = ToolShape.cylinder(radius=0.01, length=0.1, position=(0.0, 0.0, -0.05))
    """

    geometry: Geometry
    placement: Array
    """(4, 4) the shape's frame in the tool frame, m."""

    def __post_init__(self) -> None:
        """Refuse what is no body, and keep plain numbers."""
        checks = Checks("a tool shape")
        if isinstance(self.geometry, HalfSpace):
            checks.wrong("geometry", self.geometry, "must be a shape that an arm can carry")
        _keep_body(checks, self)
        checks.done()

    @staticmethod
    def box(size: Point, position: Point = ORIGIN, rpy_deg: Point = ORIGIN) -> ToolShape:
        """A box; see `Obstacle.box`, with position and rpy_deg in the tool frame."""
        return _placed(ToolShape, Box(cast("Any", size)), position, rpy_deg)

    @staticmethod
    def cylinder(
        radius: float, length: float, position: Point = ORIGIN, rpy_deg: Point = ORIGIN
    ) -> ToolShape:
        """A cylinder along z of its own frame, m."""
        return _placed(ToolShape, Cylinder(radius, length), position, rpy_deg)

    @staticmethod
    def sphere(radius: float, position: Point = ORIGIN, rpy_deg: Point = ORIGIN) -> ToolShape:
        """A ball, m."""
        return _placed(ToolShape, Sphere(radius), position, rpy_deg)

    @staticmethod
    def capsule(
        radius: float, length: float, position: Point = ORIGIN, rpy_deg: Point = ORIGIN
    ) -> ToolShape:
        """A cylinder along z of that length (m), with a half ball on each end."""
        return _placed(ToolShape, Capsule(radius, length), position, rpy_deg)

    @staticmethod
    def mesh(
        file: Path, scale: float | None = None, position: Point = ORIGIN, rpy_deg: Point = ORIGIN
    ) -> ToolShape:
        """The triangles of a file; see `read_triangles`."""
        return _placed(ToolShape, (file, scale), position, rpy_deg)


SHAPES: Mapping[str, tuple[str, ...]] = {
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "sphere": ("radius",),
    "capsule": ("radius", "length"),
    "halfspace": (),
    "mesh": ("file", "scale"),
}
"""The kinds of objects, and what describes each: the arguments of the function of that name."""


def _keep_body(checks: Checks, value: Obstacle | ToolShape) -> None:
    """Give a value plain numbers and a write-protected place."""
    object.__setattr__(value, "geometry", checked_shape(checks, value.geometry))
    placement = rigid_matrix(checks, "placement", value.placement, FARTHEST)
    placement.flags.writeable = False
    object.__setattr__(value, "placement", placement)


def _placed(
    make: Callable[..., Made], geometry: object, position: Any, rpy_deg: Any, **own: Any
) -> Made:
    """An object or a tool shape at a place, of a shape or a file and its scale; all its faults."""
    checks = Checks(f"obstacle {own['name']!r}" if own else "a tool shape")
    if isinstance(geometry, tuple):
        file, geometry = geometry, PLACEHOLDER
        try:
            geometry = read_triangles(*file)
        except ArgumentError as error:
            checks.faults += error.faults
    placement = matrix_of(checks, position, rpy_deg, FARTHEST)
    try:
        made = make(geometry=geometry, placement=placement, **own)
    except ArgumentError as error:
        checks.faults += error.faults
    checks.done()
    return made


def checked_distance(checks: Checks, key: str, value: object) -> float:
    """m, a clearance or a thickness."""
    expected = f"must be a number in 0 .. {CLEAREST:g} (metres)"
    return checks.number(key, value, expected, 0.0, CLEAREST)
