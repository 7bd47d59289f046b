"""The kinds of surface that a case can name, and whose keys are whose."""

from __future__ import annotations

from collections.abc import Mapping

from coverable_errors import alternatives
from feasibility.cases.mesh_keys import MESH_KEYS
from feasibility.cases.patch_keys import PATCHES, patch_keys
from feasibility.cases.table_reader import DEG, METRES

PIECES_KEYS = ("pieces", "gap")
OWN_KEYS: Mapping[str, tuple[str, ...]] = {
    **{kind: patch_keys(kind) for kind in PATCHES},
    "piecewise": PIECES_KEYS,
    "mesh": MESH_KEYS,
}
CLOSED_FORM_KINDS = ("sphere", "cylinder", "hyperboloid", "plane")
"""The kinds that the greedy search knows."""


def foreign_keys(kind: str) -> dict[str, str]:
    """What to say about keys that belong to other kinds of surface."""
    owners: dict[str, list[str]] = {}
    for other, keys in OWN_KEYS.items():
        for key in keys:
            owners.setdefault(key, []).append(_a(other))
    hints = {
        key: f"belongs to {alternatives(names)}, not to {_a(kind)}; leave it out"
        for key, names in owners.items()
    }
    for mine in ("u", "v", "u_deg", "v_deg"):
        if mine in OWN_KEYS[kind]:
            letter = mine[0]
            other = letter if mine.endswith("_deg") else f"{letter}_deg"
            unit = DEG if mine.endswith("_deg") else METRES
            unit = "the numbers of the knots" if kind == "bspline" else unit
            hints[other] = f"is not how {_a(kind)} is written; write {mine} in {unit}"
    return {key: hint for key, hint in hints.items() if key not in OWN_KEYS[kind]}


def _a(kind: str) -> str:
    """The kind with its article."""
    if kind == "piecewise":
        return "a piecewise surface"
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"
