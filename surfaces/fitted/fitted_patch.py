"""FittedPatch: a spline that stands for another surface, with what it may deviate from it."""

from __future__ import annotations

from dataclasses import dataclass

from coverable_arrays import Array
from surfaces.patches import SpaceModel
from surfaces.patches.nurbs import SplinePatch


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class FittedPatch(SplinePatch):
    """A spline through points of a surface; outward is along S_u x S_v."""

    made_from: str
    """'parametric' for a formula, 'grid' for points."""
    off: tuple[float, float]
    """How far points (m) and normals (1) may be from those of the surface meant, at most."""
    words: tuple[str, ...]
    """What a user should know, one sentence each."""

    @property
    def kind(self) -> str:  # type: ignore[override]
        """What it was made from."""
        return self.made_from

    @property
    def notes(self) -> tuple[str, ...]:
        """See `Surface.notes`."""
        return self.words

    @property
    def deviations(self) -> tuple[float, float]:
        """See `Surface.deviations`."""
        return self.off

    def part_models(self, low: Array, high: Array) -> tuple[SpaceModel, SpaceModel]:
        """Of the surface meant: those of the spline, wider by what it may deviate."""
        points, normals = SplinePatch.part_models(self, low, high)
        return (
            points._replace(error=points.error + self.off[0]),
            normals._replace(error=normals.error + self.off[1]),
        )
