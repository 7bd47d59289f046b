"""Two changes that make a case feasible together, where no single one does.

Wider limits, a wider cone and smaller clearances only ever help. So they are all opened at once; if
that is feasible, they are put back one after another as long as it stays feasible, and what cannot
be put back is needed. A shift of the surface, which may do harm too, is tried in a few sizes, alone
with the others opened, and with a second shift.
"""

import itertools
import math
from collections.abc import Iterator, Sequence

from feasibility.sensitivity.probes import REMEDIES, Prober, Steps, last_true
from feasibility.sensitivity.quantities import Kind, Quantity
from feasibility.sensitivity.thresholds import Change, ChangePair

SHIFTS = (0.2, 0.5, 1.0)  # [1] of the largest shift: sizes that are tried
LAST_PUT_BACK = (Kind.ROLL, Kind.CONE, Kind.CLEARANCE, Kind.TOOL_CLEARANCE)


def changes_together(prober: Prober, varied: Sequence[Quantity]) -> ChangePair | None:
    """Two changes, each as small as it was found to do; None where none were found.

    Raises:
        OutOfTime: the deadline passed.
    """
    for steps in _sets(prober, varied):
        if len(steps) == 2:
            return _narrowed(prober, steps)
    return None


def _sets(prober: Prober, varied: Sequence[Quantity]) -> Iterator[Steps]:
    """Sets of changes that were found to be feasible, no member of which can be left out."""
    shifts = [q for q in varied if q.kind is Kind.SHIFT]
    # The cone is put back last: of two pairs the one with it needs fewer new joint limits.
    helpers = [q for q in varied if q.kind in (Kind.LOWER, Kind.UPPER)]
    helpers += [q for q in varied if q.kind in LAST_PUT_BACK]
    opened = tuple((quantity, quantity.last) for quantity in helpers)
    if prober.at(opened).walk:
        yield _needed(prober, opened, opened)
    for share in SHIFTS:
        moved = [(shift, max(1, round(share * shift.last))) for shift in shifts]
        for step in moved:
            if prober.at((step, *opened)).walk:
                yield _needed(prober, (step, *opened), opened)
        for one, other in itertools.combinations(moved, 2):
            opposite = one[0].axis == tuple(-x for x in other[0].axis)
            if not opposite and prober.at((one, other)).walk:
                yield one, other


def _needed(prober: Prober, steps: Steps, removable: Steps) -> Steps:
    """Those of some changes that are feasible together which cannot be left out."""
    needed = steps
    for step in removable:
        rest = tuple(other for other in needed if other is not step)
        if len(needed) < 2:
            break
        # A motion that uses all of them may lead to none with fewer, and a search alone to one.
        if prober.at(rest, prober.at(needed).walk).walk or prober.at(rest, judged=True).walk:
            needed = rest
    return needed


def _narrowed(prober: Prober, steps: Steps) -> ChangePair | None:
    """Both changes made as small as they were found to do, one after the other.

    None where `check` does not accept the motion, of the small ones nor of those given.
    """
    narrow = steps
    for index in (0, 1):
        narrow = _smaller(prober, narrow, *narrow[index])
    for found in (narrow, steps):
        walk = prober.at(found, prober.at(found).walk, judged=True).walk
        if walk is not None:
            changes = tuple(Change(quantity, quantity.value(k)) for quantity, k in found)
            return ChangePair(changes, walk)
    return None


def _smaller(prober: Prober, steps: Steps, quantity: Quantity, k: int) -> Steps:
    """The same with one of them as small as was found to do."""
    seeds = prober.at(steps).walk

    def changed(k: int) -> Steps:
        return tuple((other, k if other is quantity else j) for other, j in steps)

    def holds(k: int) -> bool:
        nonlocal seeds
        found = prober.at(changed(k), seeds)
        seeds = found.walk or seeds
        return found.walk is not None

    return changed(last_true(holds, k, 0, math.ceil(k / REMEDIES))[0])
