"""Surfaces at home, where their own frame is the root frame: what is known there holds anywhere."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import fields, replace
from typing import Any

import numpy as np

from surfaces.surface import Surface

POSE = ("rotation", "position", "side")


class AtHome:
    """A surface at home, and what else is given; equal to others that differ in their pose alone.

    So it may be the argument of a function that remembers its results.
    """

    def __init__(self, surface: Surface, *more: Any) -> None:
        """Take a surface home."""
        self.surface: Any = replace(surface, rotation=np.eye(3), position=np.zeros(3))
        self.more = more
        names = (field.name for field in fields(surface) if field.init and field.name not in POSE)
        values = (*(getattr(surface, name) for name in names), *more)
        self._known = (type(surface), *map(_plain, values))

    def __eq__(self, other: object) -> bool:
        """Whether all is the same but for the pose."""
        return isinstance(other, AtHome) and self._known == other._known

    def __hash__(self) -> int:
        """Of all that is compared."""
        return hash(self._known)


def _plain(value: Any) -> Hashable:
    """A value to compare: arrays by their bytes, tuples by their items, others by themselves."""
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    if isinstance(value, np.ndarray):
        return (value.shape, value.tobytes())
    return value if isinstance(value, Hashable) else id(value)
