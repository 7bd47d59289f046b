"""Names of what can collide, pairs of them, and distances, as a user gives them: checked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from coverable.errors import Checks, Fault, close, shown

CLEAREST = 10.0  # [m], the largest clearance, and the thickest sheet


def checked_distance(checks: Checks, key: str, value: object) -> float:
    """m, a clearance or a thickness."""
    expected = f"must be a number in 0 .. {CLEAREST:g} (metres)"
    return checks.number(key, value, expected, 0.0, CLEAREST)


def stranger(key: str, name: str, known: Sequence[str], what: str) -> list[Fault]:
    """The fault of a name that is not known, if it is not."""
    if name in known:
        return []
    guess = close(name, known)
    hint = f"did you mean {guess}?" if guess else f"there are {', '.join(known[:20])}"
    return [Fault(key, f"got {shown(name)}; {hint}", expected=f"must be {what}")]


def sequence(checks: Checks, key: str, value: Any, expected: str) -> Sequence[Any]:
    """A list or tuple; empty after a fault."""
    if isinstance(value, (list, tuple)):
        return value
    checks.wrong(key, value, expected)
    return ()


def names_of(checks: Checks, key: str, value: Any) -> tuple[str, ...]:
    """Names, each once."""
    expected = 'must be a list of names of links, such as ["nozzle"]'
    names = sequence(checks, key, value, expected)
    if not all(isinstance(name, str) and name for name in names):
        checks.wrong(key, value, expected)
        return ()
    refuse_repeated(checks, key, names)
    return tuple(names)


def checked_pair(checks: Checks, key: str, value: Any) -> tuple[str, str] | None:
    """Two different names."""
    expected = 'must be two different names, such as ["link5", "link7"]'
    if isinstance(value, (list, tuple)) and len(value) == 2:
        first, second = value
        if all(isinstance(name, str) and name for name in value) and first != second:
            return first, second
    checks.wrong(key, value, expected)
    return None


def pairs_of(checks: Checks, key: str, value: Any) -> tuple[tuple[str, str], ...]:
    """Pairs of names; the same twice does no harm."""
    expected = 'must be a list of pairs of names, such as [["link5", "link7"]]'
    rows = sequence(checks, key, value, expected)
    found = [checked_pair(checks, f"{key}[{k}]", row) for k, row in enumerate(rows)]
    return tuple(pair for pair in found if pair is not None)


def clearances_of(checks: Checks, value: Any) -> tuple[tuple[str, str, float], ...]:
    """Pairs with a distance each, no pair twice."""
    key, found = "clearances", []
    expected = "must be a list of (name, name, metres)"
    for k, row in enumerate(sequence(checks, key, value, expected)):
        if not isinstance(row, (list, tuple)) or len(row) != 3:
            checks.wrong(f"{key}[{k}]", row, "must be (name, name, metres)")
            continue
        pair = checked_pair(checks, f"{key}[{k}].pair", row[:2])
        distance = checked_distance(checks, f"{key}[{k}].value", row[2])
        if pair is not None:
            found.append((*pair, distance))
    refuse_repeated(checks, key, [" and ".join(sorted(row[:2])) for row in found])
    return tuple(found)


def refuse_repeated(checks: Checks, key: str, names: Iterable[str]) -> None:
    """Keep a fault of each name that is there more than once."""
    for name, count in Counter(names).items():
        if count > 1:
            checks.keep(Fault(key, f"has {shown(name)} {count} times; one of them is enough"))
