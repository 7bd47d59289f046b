"""All bodies and pairs of one problem, where collisions are checked at all.

What gathers them reads meshes, and is imported only then.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from feasibility.collisions.words import checked_words

if TYPE_CHECKING:
    from feasibility.collisions.problem_bodies import Bodies
    from feasibility.collisions.settings import Collision
    from robots.robot import Robot
    from surfaces.surface import Surface


def gather(
    robot: Robot, surface: Surface, collision: Collision | None, standoff: float
) -> Bodies | None:
    """All bodies and pairs of one problem; None where collisions are not checked.

    Where the standoff (m) is 0 the tool touches the surface, and that pair is left out.

    Raises:
        RobotError: no link has a shape, or the SRDF is not of this arm.
        ArgumentError: a pair names something that is not there; all such names are given.
        SurfaceError: no bounds on the surface are known.
    """
    if collision is not None and collision.surface and surface.wall is None:
        collision = collision.without_surface
    if collision is None or not collision.checked:
        return None
    from feasibility.collisions.gathering import gathered

    return gathered(robot, surface, collision, float(standoff))


def said_of(robot: Robot, collision: Collision | None) -> str:
    """The sentence that says what is checked, and what of the tool has no body.

    Raises:
        RobotError: no link has a shape, or the SRDF is not of this arm.
    """
    said = checked_words(collision)
    if collision is None or not collision.checked:
        return said
    from feasibility.collisions.gathering import bare_stretch

    return "; ".join([said, *bare_stretch(robot, collision).values()])
