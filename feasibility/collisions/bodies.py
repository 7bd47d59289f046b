"""Everything that can collide in one problem, and the pairs that are asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.collisions.scene import Obstacle
from robots.shapes import Polytope, Solid

if TYPE_CHECKING:
    from feasibility.collisions.settings import Collision
    from robots import Robot
    from surfaces import Sheet, Surface


@dataclass(frozen=True, eq=False, slots=True)
class Soup:
    """Triangles at rest that are no convex body: the surface, or a mesh of the scene."""

    owner: str
    """'surface', or the object's name."""
    triangles: NDArray[np.float64]
    """(k, 3, 3) m, in the root frame."""
    deviation: float
    """m, how far the body may stand out from its triangles; every clearance is larger by it."""
    closed: bool
    """True where they bound a solid, which has an inside."""
    sheet: Sheet | None = None
    """Where they are a surface's: the same triangles in its own frame, wherever it stands."""


class Seat(NamedTuple):
    """An object of the scene, and what carries it."""

    obstacle: Obstacle
    """With its placement in the frame of that joint (Pinocchio's)."""
    joint: int
    """0 where it is at rest in the root frame."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two owners of bodies that must stay apart."""

    first: str
    """A link or 'tool': it moves."""
    second: str
    """A link, 'tool', an object of the scene, or 'surface'."""
    clearance: float
    """m, the least distance between them."""


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Two owners that are not asked for, and why."""

    first: str
    second: str
    why: str
    """adjacent, rigid, always, allowed, srdf or contact."""
    rate: float | None = None
    """Share of random configurations in which they collide; None where it was not measured."""


@dataclass(frozen=True, eq=False, slots=True)
class Bodies:
    """All bodies of one problem; pure data, for the search and for the judge alike."""

    solids: tuple[Solid, ...]
    """Exact shapes of links, tool and carried objects, for the judge and for pictures."""
    polytopes: tuple[Polytope, ...]
    """Convex bodies around them, and those of convex objects at rest (joint 0)."""
    soups: tuple[Soup, ...]
    """The surface, and objects at rest that are not convex."""
    scene: tuple[Obstacle, ...]
    """The objects at rest, with their place in the root frame, for the judge and for pictures."""
    pairs: tuple[Pair, ...]
    left_out: tuple[LeftOut, ...] = ()
    unchecked: tuple[str, ...] = ()
    """Links without any shape."""
    checked: tuple[str, ...] = ()
    """Which of self, surface, scene are asked for."""
    notes: tuple[str, ...] = ()
    """What a user should know, one sentence each."""
    carried: tuple[Seat, ...] = ()
    """The objects of the scene that move, for pictures."""


def gather(
    robot: Robot, surface: Surface, collision: Collision | None, standoff: float
) -> Bodies | None:
    """All bodies and pairs of one problem; None where collisions are not checked.

    Args:
        robot: the arm.
        surface: what it works on.
        collision: what is asked for.
        standoff: m; where it is 0 the tool touches the surface, and that pair is left out.

    Raises:
        RobotError: no link has a shape, or the SRDF is not of this arm.
        ArgumentError: a pair names something that is not there; all such names are given.
        SurfaceError: no bounds on the surface are known.
    """
    if collision is not None and collision.surface and surface.wall is None:
        collision = collision.without_surface
    if collision is None or not collision.checked:
        return None
    from feasibility.collisions.gathering import gathered  # it reads meshes

    return gathered(robot, surface, collision, float(standoff))
