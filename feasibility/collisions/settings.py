"""The table [collision]: what is asked to stay clear of what, and by how much."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from feasibility.collisions.scene import Obstacle, ToolShape

Fineness = Literal["hulls", "pieces", "meshes"]


@dataclass(frozen=True, eq=False, slots=True)
class Collision:
    """What the arm has to stay clear of, in `check(..., collision=Collision())`."""

    self_: bool = True
    """Links against each other."""
    surface: bool = True
    """The arm against the surface itself, a two-sided sheet."""
    clearance: float = 0.0
    """m, every pair."""
    tool_clearance: float = 0.0
    """m, the tool against the surface."""
    tool_links: tuple[str, ...] = ()
    """Links that are the tool; where none are named, the shapes that move with the last joint."""
    allow: tuple[tuple[str, str], ...] = ()
    """Pairs that are not asked for: links, objects of the scene, 'surface' or 'tool'."""
    clearances: tuple[tuple[str, str, float], ...] = field(default=())
    """Pairs with a clearance of their own, m."""
    srdf: str | None = None
    """Path of an SRDF whose pairs are left out."""
    shapes: Fineness = "hulls"
    """What the search takes for a link: one hull a shape, convex pieces of it, or pieces with the
    judge's word on the meshes themselves."""
    thickness: float = 0.0
    """m, of the sheet, away from the working side."""
    scene: tuple[Obstacle, ...] = ()
    tool: tuple[ToolShape, ...] = ()

    @property
    def checked(self) -> tuple[str, ...]:
        """What is asked for: some of 'self', 'surface' and 'scene'."""
        asked = {"self": self.self_, "surface": self.surface, "scene": bool(self.scene)}
        return tuple(name for name, wanted in asked.items() if wanted)
