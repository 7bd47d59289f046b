"""Check the numbers that a robot is loaded with, before its URDF is read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from coverable_errors import Checks, printable
from robots.errors import RobotError


def check_arguments(
    approach_axis: Any = None, lock: Mapping[str, Any] | None = None, source: str = ""
) -> None:
    """Refuse an approach axis and held values that fit no arm.

    Args:
        approach_axis: (3,) of any length; None for the default.
        lock: joint name -> rad or m.
        source: what the arguments are of, for the message.

    Raises:
        RobotError: with everything that is wrong.
    """
    checks = Checks(source, RobotError)
    if approach_axis is not None:
        checks.direction("approach_axis", approach_axis)
    for joint, value in (lock or {}).items():
        checks.number(f"lock.{printable(joint)}", value, "must be a finite number (rad or m)")
    checks.done()
