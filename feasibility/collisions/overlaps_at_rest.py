"""Bodies at rest that overlap from the start, which no motion changes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from robots.shapes.bodies import Polytope
from robots.shapes.coal_shapes import coal_distance

Pair = tuple[str, str]

NOTED = 5e-3  # [m] of overlap: the base of a ur5, as drawn, ends 4 mm below its frame


def overlapping(bodies: Sequence[Polytope], pairs: Iterable[Pair]) -> list[str]:
    """A sentence for each pair of owners at rest whose convex bodies overlap.

    Args:
        bodies: convex ones, each in the root frame.
        pairs: of owners.
    """
    of_owner: dict[str, list[Polytope]] = {}
    for body in bodies:
        of_owner.setdefault(body.owner, []).append(body)
    notes = []
    for first, second in pairs:
        both = of_owner.get(first, ()), of_owner.get(second, ())
        nearest = min((coal_distance(a, b) for a in both[0] for b in both[1]), default=0.0)
        if nearest < -NOTED:
            notes.append(
                f"{first} and {second} are rigid to each other, so the pair is not checked, but "
                f"they overlap by {-1e3 * nearest:.1f} mm"
            )
    return notes
