"""Check the numbers that a robot is loaded with, before its URDF is read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from coverable.arrays import Array
from coverable.errors import Checks, Fault, printable, shown
from robots.errors import RobotError
from robots.poses import FURTHEST_BASE, FURTHEST_TCP, checked_pose, made_orthogonal, unit_axis

if TYPE_CHECKING:
    from robots.urdf.axes import Axis


class Mounting(NamedTuple):
    """Where tool, arm and surface are mounted; None where a URDF alone says so."""

    tcp: Array | None
    """(4, 4) m, the tool centre point in the frame of the link `tool_frame`."""
    base: Array | None
    """(4, 4) m, the URDF's root link in the world, or on the last axis that carries it."""
    axes: tuple[Axis, ...] = ()
    """Axes that are no part of the URDF, from the world outwards."""
    surface_link: str | None = None
    """The link that carries the surface."""


AS_IN_URDF = Mounting(None, None)


def check_arguments(
    approach_axis: Any = None,
    lock: Mapping[str, Any] | None = None,
    source: str = "",
    *,
    tcp: Any = None,
    base: Any = None,
    reference_axis: Any = None,
    axes: Any = (),
    xacro_args: Any = None,
) -> Mounting:
    """Refuse axes, poses and held values that fit no arm.

    Args:
        approach_axis: (3,) of any length; None for the default.
        lock: joint name -> rad or m.
        source: what the arguments are of, for the message.
        tcp, base: poses, see `load_robot`; None for the default.
        reference_axis: (3,) of any length; None for the default.
        axes: that arm or surface are mounted on.
        xacro_args: name -> text, number or truth value; None for none.

    Raises:
        RobotError: with everything that is wrong.

    Returns:
        The poses as matrices, and the axes.
    """
    checks = Checks(source, RobotError)
    directions = {"approach_axis": approach_axis, "reference_axis": reference_axis}
    for key, value in directions.items():
        if value is not None:
            checks.direction(key, value)
    if approach_axis is not None and reference_axis is not None and not checks.faults:
        _refuse_parallel(checks, approach_axis, reference_axis)
    for joint, value in (lock or {}).items():
        checks.number(f"lock.{printable(joint)}", value, "must be a finite number (rad or m)")
    _check_xacro_args(checks, {} if xacro_args is None else xacro_args)
    listed = isinstance(axes, (list, tuple))
    if not listed or (axes and not _are_axes(axes)):
        checks.wrong("axes", axes, "must be a list of Axis")
    mounting = Mounting(
        None if tcp is None else checked_pose(checks, "tcp", tcp, FURTHEST_TCP),
        None if base is None else checked_pose(checks, "base", base, FURTHEST_BASE),
        tuple(axes) if listed else (),
    )
    checks.done()
    return mounting


def _are_axes(axes: Sequence[Any]) -> bool:
    """Are all of these axes?"""
    from robots.urdf.axes import Axis

    return all(isinstance(axis, Axis) for axis in axes)


def _check_xacro_args(checks: Checks, args: Any) -> None:
    """Keep the faults of arguments that no xacro file can have."""
    if not isinstance(args, Mapping) or not all(isinstance(name, str) for name in args):
        checks.wrong("xacro_args", args, "must be names and values, such as {'prefix': 'left_'}")
        return
    for name, value in args.items():
        if not isinstance(value, (str, bool, int, float)):
            expected = "must be a text, a number, true or false"
            checks.wrong(f"xacro_args.{printable(name)}", value, expected)


def _refuse_parallel(checks: Checks, approach: Any, reference: Any) -> None:
    """Keep the fault of two axes between which there is no angle to measure a roll by."""
    axes = (np.asarray(axis, dtype=float) for axis in (reference, approach))
    across = made_orthogonal(*map(unit_axis, axes))
    if np.isnan(across).any():
        what = f"got {shown(reference)}, which is parallel to the approach axis {shown(approach)}"
        expected = "must point across the approach axis, for roll is measured by its part across it"
        checks.keep(Fault("reference_axis", what, expected=expected))
