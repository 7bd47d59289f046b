"""Piecewise: several patches joined along their seams into one surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from coverable.errors import Fault
from surfaces.arguments import ORIGIN, Checks
from surfaces.patches.patch import Patch
from surfaces.piecewise.joined_patches import JoinedPatches
from surfaces.piecewise.piece_cells import PieceCells
from surfaces.piecewise.seams import on_each_other, sides_of, survey, turned_pieces
from surfaces.surface import Side, SurfaceError

GAP = 1e-4  # m, how far apart two borders may be that are one seam
SHARE = 1e-3  # [1], and the same as a share of the shortest border
WIDEST = 0.02  # [1], the largest gap that may be given, as a share of the shortest border
MOST_PIECES = 200


@dataclass(frozen=True, eq=False, repr=False)
class Piecewise(JoinedPatches):
    """Patches joined along seams, which can be cut into cells; see `piecewise`."""

    def cells(self, counts: Any) -> PieceCells:
        """Cut every piece into a grid of cells.

        Args:
            counts: (nu, nv) for all pieces alike, or a list of one (nu, nv) for each.

        Raises:
            SurfaceError: that is not what the counts are.
        """
        return PieceCells.cut(self, counts)


def piecewise(
    pieces: Sequence[Patch],
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
    gap: float | None = None,
) -> Piecewise:
    """Several patches joined into one surface along the borders that they share.

    Borders are found by geometry: wherever two of different pieces run along each other, on all
    or a part of their length. The first piece of each joined group defines outward; others are
    turned over where they disagree, and `notes` names them. Pieces that lie on each other
    are refused; that they do not cut through each other is not checked.

    Args:
        pieces: patches of any kinds, placed in the frame of the joined surface. Their own `side`
            is not used.
        side: 'outside' for a tool on the outward side, 'inside' for one on the other.
        position: see `plane`, as for rpy_deg.
        gap: m, how far apart the borders of a seam may be; None for 0.1 mm, and at most a
            thousandth of the shortest border.

    Raises:
        SurfaceError: one or more of the arguments are wrong, all are named; or pieces lie on each
            other, or three share one seam; or no choice of outward sides is consistent, as on a
            Moebius strip.

    Example:
        >>> from coverable import sphere
        >>> east, west = (sphere(1.0, (20, 90), ends) for ends in ((0, 180), (180, 360)))
        >>> len(piecewise([east, west]).cells((4, 6)).pairs) == len(
        ...     sphere(1.0, (20, 90), (0, 360)).cells(4, 12).pairs)
        True
    """
    check = Checks("piecewise")
    patches = _patches(pieces, check)
    width = _gap(gap, patches, check)
    pose = check.pose(side, position, rpy_deg)
    check.done()
    sheets = on_each_other(patches, width)
    if sheets:
        raise SurfaceError(
            f"pieces[{sheets[0]}] and pieces[{sheets[1]}] lie on each other, at least in part; "
            "leave one of them out, or cut it back to the seam",
            "piecewise",
        )
    seams, overfull = survey(patches, width)
    if overfull:
        names = ", ".join(f"pieces[{k}]" for k in overfull)
        raise SurfaceError(
            f"{names} share one seam; a surface has two sides of a seam at most; leave one of them "
            "out",
            "piecewise",
        )
    return Piecewise(
        pieces=patches,
        turned=turned_pieces(len(patches), seams),
        gap=width,
        seams=seams,
        **pose,
    )


def _patches(pieces: Any, check: Checks) -> tuple[Patch, ...]:
    """The pieces; none after a fault."""
    a_patch = "such as surfaces.plane makes"
    if not isinstance(pieces, Sequence) or not 1 <= len(pieces) <= MOST_PIECES:
        size = f"{len(pieces)} of them" if isinstance(pieces, Sequence) else type(pieces).__name__
        expected = f"must be a list of 1 to {MOST_PIECES} patches, {a_patch}"
        check.keep(Fault("pieces", f"got {size}", expected=expected))
        return ()
    found = tuple(piece for piece in pieces if isinstance(piece, Patch))
    for k, piece in enumerate(pieces):
        if not isinstance(piece, Patch):
            got = f"got {type(piece).__name__}"
            check.keep(Fault(f"pieces[{k}]", got, expected=f"must be a patch, {a_patch}"))
    return found if len(found) == len(pieces) else ()


def _gap(gap: Any, patches: tuple[Patch, ...], check: Checks) -> float:
    """m, how far apart borders of a seam may be."""
    shortest = min((side.length for side in sides_of(patches, 1e-7)), default=math.inf)
    if gap is None:
        return min(GAP, SHARE * shortest)
    width = check.positive("gap", gap)
    if patches and width > WIDEST * shortest:
        shortest_border = f"the shortest border, {WIDEST * shortest:.3g} m"
        check.wrong("gap", gap, f"must be at most a fiftieth of {shortest_border}")
    return width
