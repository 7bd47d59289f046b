"""Write the URDFs of robots/arms from its table of published figures.

    python tools/industrial_urdfs.py

The bodies are capsules: around the foot, around the line from axis 1 to axis 2, along the upper
arm, from axis 3 to axis 4, along the forearm, and around the wrist up to the flange.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent.parent / "robots" / "arms"
HEAD = """<?xml version="1.0"?>
<!-- Written by `python tools/industrial_urdfs.py`; change industrial.toml, not this file. -->
<!-- The capsules are estimates, and not the maker's housing. Kinematics: {sources}. -->
"""
Axis = tuple[float, float, float]
UP, FORWARD, TURN = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
LEVEL = math.pi / 2


def urdf(name: str, arm: dict[str, Any]) -> str:
    """The URDF of one arm."""
    height, ahead, upper, over, forearm, flange = (mm / 1000 for mm in arm["lengths"])
    foot, thick, thin, wrist = (mm / 1000 for mm in arm["radii"])
    zero, signs = arm.get("zero", "arm up"), arm.get("axes", [1] * 6)
    arm_axis = FORWARD if zero == "arm level" else UP
    fore_axis = UP if zero == "all up" else FORWARD
    axes = [UP, TURN, TURN, fore_axis, TURN, fore_axis]
    places = [(height, UP), (ahead, FORWARD), (upper, arm_axis)]
    places += [(over, UP), (forearm, fore_axis), (flange, fore_axis)]
    links = [  # the foot stands on its plane, the wrist ends at the flange
        _link("base_link", UP, foot, height - foot, foot),
        _link("link_1", FORWARD, 0.0, ahead, thick),
        _link("link_2", arm_axis, 0.0, upper, thick),
        _link("link_3", UP, min(0.0, over), max(0.0, over), thin),
        _link("link_4", fore_axis, 0.0, forearm, thin),
        _link("link_5", fore_axis, 0.0, flange - wrist, wrist),
        '  <link name="link_6"/>\n  <link name="tool0"/>\n',
    ]
    every = zip(places, axes, signs, arm["limits"], arm["speeds"], strict=True)
    joints = [_joint(number, *one) for number, one in enumerate(every, start=1)]
    back = signs[5] < 0 and zero == "arm up"  # as Yaskawa has the frame of its flange
    turn, tilt = (math.pi, -LEVEL) if back else (0.0, 0.0 if zero == "all up" else LEVEL)
    tool = (
        '  <joint name="joint_6-tool0" type="fixed">\n'
        '    <parent link="link_6"/><child link="tool0"/>\n'
        f'    <origin xyz="0 0 0" rpy="{turn:.16g} {tilt:.16g} 0"/>\n  </joint>\n'
    )
    body = "".join([*links, *joints, tool])
    return f'{HEAD.format(**arm)}<robot name="{name}">\n{body}</robot>\n'


def _along(length: float, axis: Axis) -> str:
    """A vector as a URDF has it."""
    return " ".join(f"{length * part + 0.0:.6g}" for part in axis)


def _link(name: str, axis: Axis, low: float, high: float, radius: float) -> str:
    """A link with a capsule around the line between two heights along an axis of its frame."""
    shape = f'<capsule radius="{radius:.6g}" length="{high - low:.6g}"/>'
    if low == high:
        shape = f'<sphere radius="{radius:.6g}"/>'
    place = f'xyz="{_along((low + high) / 2, axis)}" rpy="0 {LEVEL * axis[0]:.16g} 0"'
    drawn = f"<origin {place}/><geometry>{shape}</geometry>"
    return (
        f'  <link name="{name}">\n    <visual>{drawn}</visual>\n'
        f"    <collision>{drawn}</collision>\n  </link>\n"
    )


def _joint(
    number: int,
    place: tuple[float, Axis],
    axis: Axis,
    sign: int,
    limits: list[float],
    speed: float,
) -> str:
    low, high = map(math.radians, limits)
    parent = "base_link" if number == 1 else f"link_{number - 1}"
    return (
        f'  <joint name="joint_{number}" type="revolute">\n'
        f'    <parent link="{parent}"/><child link="link_{number}"/>\n'
        f'    <origin xyz="{_along(*place)}" rpy="0 0 0"/><axis xyz="{_along(sign, axis)}"/>\n'
        f'    <limit lower="{low:.16g}" upper="{high:.16g}" effort="0" '
        f'velocity="{math.radians(speed):.16g}"/>\n  </joint>\n'
    )


def main() -> None:
    """Write them all."""
    table = tomllib.loads((FOLDER / "industrial.toml").read_text(encoding="utf-8"))
    for name, arm in table.items():
        (FOLDER / f"{name}.urdf").write_text(urdf(name, arm), encoding="utf-8")


if __name__ == "__main__":
    main()
