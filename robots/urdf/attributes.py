"""Numbers and names out of XML attributes, strictly, with every fault collected."""

from __future__ import annotations

import math
import re

from coverable_errors import CoverableError, Fault
from robots.urdf.xml import Node, shown

MAX_LENGTH = 1e4  # [m] and [rad]: nothing in a robot is larger; beyond it, numbers lose digits
MAX_NAME = 200

# float() would also take 'nan', '1_000' and digits of other scripts, which URDF readers do not.
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?", re.ASCII)

Triple = tuple[float, float, float]


class Faults:
    """What is wrong with one file so far, and what is odd about it."""

    def __init__(self) -> None:
        """Start with none."""
        self.errors: list[str | Fault] = []
        self.warnings: list[str] = []
        self.soft_limits: list[str] = []
        """Names of joints whose controller would stop earlier than the limits do."""

    def error(self, node: Node, what: str) -> None:
        """Note something that makes the robot unusable."""
        self.errors.append(Fault("", what, f"line {node.line}"))

    def warn(self, node: Node, what: str) -> None:
        """Note something that leaves the robot correct."""
        self.warnings.append(f"line {node.line}: {what}")


class BadValue(CoverableError):
    """An attribute that does not hold what it should; the message says what would do."""


def numbers(node: Node, attribute: str, count: int, bound: float = MAX_LENGTH) -> list[float]:
    """`count` finite numbers of at most `bound` from an attribute that is there.

    Raises:
        BadValue: anything else.
    """
    text = node.attributes[attribute]
    words = text.split()
    example = " ".join(["0.1", "0", "0", "1"][:count])
    label = f"<{node.tag}> {attribute}={shown(text)}"
    if len(words) != count or not all(_NUMBER.fullmatch(word) for word in words):
        plural = "finite number" if count == 1 else "finite numbers separated by spaces"
        raise BadValue(f'{label} must be {count} {plural}, such as "{example}"')
    values = [float(word) for word in words]
    if not all(math.isfinite(value) and abs(value) <= bound for value in values):
        most = f" of at most {bound:g}" if math.isfinite(bound) else ""
        raise BadValue(f"{label} must hold finite numbers{most}")
    # Some readers refuse subnormal numbers.
    return [value if abs(value) > 1e-200 else 0.0 for value in values]


def triple(node: Node | None, attribute: str, default: Triple) -> Triple:
    """Three numbers, or `default` where element or attribute are missing.

    Raises:
        BadValue: the attribute holds anything else.
    """
    if node is None or attribute not in node.attributes:
        return default
    x, y, z = numbers(node, attribute, 3)
    return x, y, z


def name_of(
    node: Node, faults: Faults, attribute: str = "name", owner: str | None = None
) -> str | None:
    """A usable name, or None with the fault noted."""
    text = node.attributes.get(attribute)
    which = f"{owner}: <{node.tag}>" if owner else f"<{node.tag}>"
    if not text or not text.strip():
        faults.error(node, f'{which} has no {attribute}; write {attribute}="..."')
    elif len(text) > MAX_NAME or not text.isprintable() or text != text.strip():
        faults.error(
            node,
            f"{which} {attribute}={shown(text)} must be 1 to {MAX_NAME} printable "
            "characters without spaces at its ends",
        )
    else:
        return text
    return None


def only(node: Node, tag: str, faults: Faults, owner: str) -> Node | None:
    """The one child of that tag; several are a fault, because readers differ on which counts."""
    found = node.all(tag)
    if len(found) > 1:
        lines = ", ".join(str(child.line) for child in found[:5])
        faults.error(
            node, f"{owner} has {len(found)} <{tag}> elements (lines {lines}); keep one of them"
        )
    return found[0] if found else None
