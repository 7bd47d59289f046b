"""Directions of passes: those with the fewest pieces, and two of them one after the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from surfaces.passes.holes import with_lids
from surfaces.passes.parallel import SHORTEST, Passes, pass_lines
from surfaces.passes.triangulation import working_mesh
from surfaces.surface import Surface

STEP_DEG = 15.0
EDGES_PER_PITCH = 2.0  # pieces are counted on coarser triangles than distances are measured on


def ranked_directions(surface: Surface, pitch: float) -> list[float]:
    """Angles (rad) at steps of 15 degrees, those with the fewest pieces of passes first.

    Pieces are counted along section planes, which takes a small part of the time that the distance
    on the surface does; of equally many pieces, fewer passes come first.

    Args:
        surface: what is to be covered.
        pitch: m > 0, the largest distance between passes.

    Example:
        >>> from coverable import plane
        >>> from surfaces.passes.pass_directions import ranked_directions
        >>> found = ranked_directions(plane((0, 0.6), (0, 0.2)), 0.03)
        >>> found[0]
        0.0
    """
    lidded = with_lids(working_mesh(surface, pitch / EDGES_PER_PITCH), pitch / EDGES_PER_PITCH)
    ranks = []
    for angle in np.radians(np.arange(0.0, 180.0, STEP_DEG)).tolist():
        found = pass_lines(surface, lidded, angle, "planes", pitch)
        pieces = sum(each.line.length >= SHORTEST * found.spacing for each in found.lines)
        ranks.append((pieces, found.levels, angle))
    return [angle for _, _, angle in sorted(ranks)]


def crossed(first: Passes, second: Passes) -> Passes:
    """Passes in one direction, then those in another over the same surface, numbered on."""
    begin = 1 + max((each.level for each in first.stretches), default=-1)
    more = (replace(each, level=begin + each.level) for each in second.stretches)
    return replace(
        first,
        stretches=(*first.stretches, *more),
        spacing=max(first.spacing, second.spacing),
        widest=max(first.widest, second.widest),
        dropped=first.dropped + second.dropped,
        notes=tuple(dict.fromkeys((*first.notes, *second.notes))),
    )
