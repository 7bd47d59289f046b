"""SRDF files: pairs of links that somebody says need no check for collisions."""

from __future__ import annotations

import os
from dataclasses import dataclass

from robots.urdf.elements import Faults, UrdfError, is_xacro, name_of, parse_xml, read_bytes

TAKEN = ("Adjacent", "Default", "Always", "User")
"""Reasons that are accepted. "Never" is a guess from samples, so it is not."""


@dataclass(frozen=True, slots=True)
class DisabledPairs:
    """What an SRDF says about pairs of links."""

    taken: tuple[tuple[str, str], ...]
    """Pairs with one of the reasons `TAKEN`, in the order of the file."""
    ignored: tuple[tuple[str, int], ...]
    """Reason, empty for none, and how many pairs have it, of those that are not taken."""
    named: frozenset[str]
    """Every link of a pair, taken or not."""


def read_srdf(path: str | os.PathLike[str]) -> DisabledPairs:
    """Read the <disable_collisions> of an SRDF; nothing else of it is looked at.

    A .xacro file is expanded first, with the defaults of its arguments.

    Raises:
        UrdfError: the file cannot be read, is no SRDF, or a pair lacks a link; with every fault.
    """
    name = os.fsdecode(path)
    text: str | bytes
    if is_xacro(name):
        from robots.urdf.xacro_files import expanded

        text = expanded(name).text
    else:
        text = read_bytes(name)
    root = parse_xml(text, name)
    faults = Faults()
    if root.tag != "robot":
        raise UrdfError(f"line {root.line}: an SRDF starts with <robot name=...>", name)
    taken: dict[tuple[str, str], None] = {}
    ignored: dict[str, int] = {}
    named: set[str] = set()
    for node in root.all("disable_collisions"):
        links = [name_of(node, faults, f"link{end}") for end in (1, 2)]
        if links[0] is None or links[1] is None:
            continue
        named |= {links[0], links[1]}
        reason = node.attributes.get("reason", "")
        if reason in TAKEN:
            taken[links[0], links[1]] = None
        else:
            ignored[reason] = ignored.get(reason, 0) + 1
    if root.all("joint") or (root.all("link") and not named):
        faults.error(root, "holds links or joints: this is a URDF, where an SRDF is expected")
    if faults.errors:
        raise UrdfError(faults.errors, name)
    return DisabledPairs(tuple(taken), tuple(ignored.items()), frozenset(named))
