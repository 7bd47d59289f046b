"""When and how pieces are cut into smaller ones that may be clear where they are not."""

from __future__ import annotations

from feasibility.certification.collisions.pieces import Below, Piece

FEW = 8  # triangles, into no less of which a sheet is cut for a hull, which is larger than its mesh


def is_exact(a: Piece, b: Piece) -> bool:
    """Are they no larger than the bodies? For a half space, a hull is its mesh."""
    return isinstance(a, Below) or (a.exact and b.exact)


def can_be_cut(a: Piece, b: Piece) -> bool:
    """May smaller pieces be clear where these are not?"""
    return not isinstance(a, Below) and (_worth_cutting(a, b) or _worth_cutting(b, a))


def cut(a: Piece, b: Piece) -> list[tuple[Piece, Piece]]:
    """The larger of two pieces that are worth it, cut into its parts."""
    if _worth_cutting(a, b) and (a.ball >= b.ball or not _worth_cutting(b, a)):
        return [(part, b) for part in a.parts]
    return [(a, part) for part in b.parts]


def _worth_cutting(piece: Piece, other: Piece) -> bool:
    """Has it parts, and not so few triangles that the other's hull is what hinders?"""
    return bool(piece.parts) and (other.exact or not piece.exact or piece.triangles > FEW)
