"""Patches as areas: what of each is certified from its own motion, not at cell centres alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable_errors import ArgumentError
from feasibility.area import CertifiedArea, area_from, visited
from feasibility.clock import Clock, OutOfTime
from feasibility.division.division import Division


@dataclass(frozen=True, eq=False, slots=True)
class PatchAreas:
    """The certified area of each patch of the plan with the fewest motions."""

    patches: tuple[CertifiedArea | None, ...]
    """Inside the patch's own cells; None for a patch whose walk the replay refuses."""
    whole: float
    """m^2, of all cells, those left out too."""

    @property
    def area(self) -> float:
        """m^2, in all patches together: their cells do not overlap."""
        return sum(found.area for found in self.patches if found is not None)

    @property
    def share(self) -> float:
        """Of the area of all cells, 0 to 1."""
        return min(self.area / self.whole, 1.0) if self.whole else 0.0


def patch_areas(division: Division, clock: Clock | None = None) -> PatchAreas | str:
    """Certify the area of each patch, from the configurations of its walk over its cells.

    Args:
        division: the division.
        clock: of the command that this is a part of.

    Returns:
        The areas; or why there are none, see `feasibility.area.certified_area`.

    Example:
        >>> from feasibility.cases import load_case
        >>> from feasibility.division import divide
        >>> found = patch_areas(divide(*load_case("paper/4d").build()))
        >>> len(found.patches), found.share > 0.6
        (1, True)
    """
    robot, cells, task = division.robot, division.cells, division.task
    found = list[CertifiedArea | None]()
    try:
        with (Clock() if clock is None else clock).enforced():
            for patch in division.patches:
                within = np.zeros(len(cells), dtype=bool)
                within[patch.cells] = True
                found.append(
                    area_from(robot, cells, task, *visited(patch.walk), within=within)
                    if patch.accepted
                    else None
                )
    except ArgumentError as error:
        return str(error)
    except OutOfTime:
        return "the certified area is not known: the time limit ran out"
    return PatchAreas(tuple(found), float(cells.areas.sum()))
