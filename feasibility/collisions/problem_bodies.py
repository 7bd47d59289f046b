"""Everything that can collide in one problem, and the pairs that are checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from coverable.arrays import Array
from feasibility.collisions.scene import Obstacle
from robots.shapes.bodies import Polytope, Solid
from robots.shapes.link_pairs import LeftOut

if TYPE_CHECKING:
    from surfaces.sheet import Sheet


@dataclass(frozen=True, eq=False, slots=True)
class Soup:
    """Triangles at rest that are no convex body: the surface, or a mesh of the scene."""

    owner: str
    """'surface', or the object's name."""
    triangles: Array
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
    """Links without any shape, and the way from flange to tool point where no body is on it."""
    checked: tuple[str, ...] = ()
    """Which of self, surface, scene are checked."""
    notes: tuple[str, ...] = ()
    """What a user should know, one sentence each."""
    carried: tuple[Seat, ...] = ()
    """The objects of the scene that move, for pictures."""
