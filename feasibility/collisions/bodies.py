"""Everything that can collide in one problem, and the pairs that are asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.collisions.scene import Obstacle
from robots.shapes import Polytope, Solid


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
    """Exact shapes of links and tool, for the judge and for pictures."""
    polytopes: tuple[Polytope, ...]
    """Convex bodies around them, and those of convex objects of the scene (joint 0)."""
    soups: tuple[Soup, ...]
    """The surface, and objects of the scene that are not convex."""
    scene: tuple[Obstacle, ...]
    """The objects of the scene as given, for the judge and for pictures."""
    pairs: tuple[Pair, ...]
    left_out: tuple[LeftOut, ...] = ()
    unchecked: tuple[str, ...] = ()
    """Links without any shape."""
    checked: tuple[str, ...] = ()
    """Which of self, surface, scene are asked for."""
    notes: tuple[str, ...] = ()
    """What a user should know, one sentence each."""
