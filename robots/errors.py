"""The error of this package; a module of its own, so that all others may import it."""

from __future__ import annotations

from collections.abc import Mapping

from coverable.errors import CoverableError


class RobotError(CoverableError):
    """A robot that cannot be used: what is wrong, where, and what would do."""

    joint_kinds: Mapping[str, str] = {}
    """Of the moving joints of its URDF by name, where that could be read."""
