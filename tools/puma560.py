"""From Denavit-Hartenberg rows to a URDF, and the PUMA 560 that the project ships.

Craig's modified convention: frame i follows from frame i-1 by

    Rot(x, alpha_{i-1}) Trans(x, a_{i-1}) Rot(z, theta_i) Trans(z, d_i).

One row becomes one URDF joint about z, whose origin is that transform at theta_i = 0:
xyz = (a, -d sin(alpha), d cos(alpha)), rpy = (alpha, 0, 0). So every link frame of the URDF *is*
the DH frame of that link, and the URDF's root link carries frame 0.

`python tools/puma560.py` writes `robots/arms/puma560.urdf` anew; a test compares the two.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

PUMA560_URDF = Path(__file__).parents[1] / "robots" / "arms" / "puma560.urdf"


@dataclass(frozen=True, slots=True)
class DHRow:
    """One row of a table in Craig's modified convention; the joint turns about z by theta."""

    alpha: float
    """rad, twist from z_{i-1} to z_i about x_{i-1}."""
    a: float
    """m, distance from z_{i-1} to z_i along x_{i-1}."""
    d: float
    """m, offset from x_{i-1} to x_i along z_i."""


@dataclass(frozen=True, slots=True)
class Shape:
    """One solid of a link, drawn or for collisions; it has no part in the kinematics."""

    link: int
    """Index of the DH frame that carries the shape; 0 is the root link."""
    size: tuple[float, ...]
    """m: (x, y, z) of a box, (radius, length) of a cylinder along z, (radius,) of a sphere."""
    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """m, centre of the shape in the link's frame."""
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """rad, fixed-axis roll, pitch and yaw of the shape."""
    colour: str = "body"
    """One of the keys of the table of colours handed to `dh_urdf`; of no use in collisions."""


def dh_urdf(
    name: str,
    rows: Sequence[DHRow],
    limits_deg: Sequence[tuple[float, float]],
    shapes: Sequence[Shape] = (),
    colours: dict[str, tuple[float, float, float, float]] | None = None,
    collisions: Sequence[Shape] = (),
    without_collisions: Sequence[int] = (),
    comment: str = "",
) -> str:
    """Return the URDF text of a serial arm of revolute joints given by DH rows.

    Links are called `base`, `link1`, `link2`, ..., joints `joint1`, `joint2`, ...

    Args:
        name: the robot's name.
        rows: n rows, base to tip.
        limits_deg: n pairs (lower, upper), degrees.
        shapes: solids to draw.
        colours: red, green, blue and alpha in 0 .. 1 of each colour that `shapes` names.
        collisions: solids that can collide.
        without_collisions: links whose drawn solids are none that collide.
        comment: what the file says about them.
    """
    palette = colours or {}
    lines = [
        '<?xml version="1.0"?>',
        "<!-- Written by `python tools/puma560.py`; change that file, not this one. -->",
        *([f"<!-- {comment} -->"] if comment else []),
        f"<robot name={quoteattr(name)}>",
    ]
    for key, rgba in palette.items():
        lines.append(f'  <material name={quoteattr(key)}><color rgba="{_text(rgba)}"/></material>')
    for i in range(len(rows) + 1):
        mine = ([shape for shape in group if shape.link == i] for group in (shapes, collisions))
        lines += _link(i, *mine, i in without_collisions)
    for i, (row, limits) in enumerate(zip(rows, limits_deg, strict=True), start=1):
        lines += _joint(i, row, limits)
    lines.append("</robot>")
    return "\n".join(lines) + "\n"


def _link(
    index: int, shapes: Sequence[Shape], collisions: Sequence[Shape], without: bool
) -> list[str]:
    """URDF lines of one link and its shapes."""
    start = f'  <link name="{_link_name(index)}"' + (' collision="none"' if without else "")
    if not shapes and not collisions:
        return [f"{start}/>"]
    lines = [f"{start}>"]
    for shape in shapes:
        lines += [
            "    <visual>",
            f'      <origin xyz="{_text(shape.xyz)}" rpy="{_text(shape.rpy)}"/>',
            f"      <geometry>{_geometry(shape.size)}</geometry>",
            f"      <material name={quoteattr(shape.colour)}/>",
            "    </visual>",
        ]
    for shape in collisions:
        lines += [
            "    <collision>",
            f'      <origin xyz="{_text(shape.xyz)}" rpy="{_text(shape.rpy)}"/>',
            f"      <geometry>{_geometry(shape.size)}</geometry>",
            "    </collision>",
        ]
    return [*lines, "  </link>"]


def _joint(index: int, row: DHRow, limits_deg: tuple[float, float]) -> list[str]:
    """URDF lines of one revolute joint about z."""
    xyz = (row.a, -math.sin(row.alpha) * row.d, math.cos(row.alpha) * row.d)
    lower, upper = (math.radians(limit) for limit in limits_deg)
    return [
        f'  <joint name="joint{index}" type="revolute">',
        f'    <parent link="{_link_name(index - 1)}"/>',
        f'    <child link="{_link_name(index)}"/>',
        f'    <origin xyz="{_text(xyz)}" rpy="{_text((row.alpha, 0.0, 0.0))}"/>',
        '    <axis xyz="0 0 1"/>',
        f'    <limit lower="{_number(lower)}" upper="{_number(upper)}" effort="100" velocity="3"/>',
        "  </joint>",
    ]


def _link_name(index: int) -> str:
    return f"link{index}" if index else "base"


def _geometry(size: tuple[float, ...]) -> str:
    """URDF element of a box, cylinder or sphere, by the number of its sizes."""
    if len(size) == 3:
        return f'<box size="{_text(size)}"/>'
    if len(size) == 2:
        return f'<cylinder radius="{_number(size[0])}" length="{_number(size[1])}"/>'
    return f'<sphere radius="{_number(size[0])}"/>'


def _text(values: Sequence[float]) -> str:
    """Numbers as URDF text."""
    return " ".join(_number(value) for value in values)


def _number(value: float) -> str:
    # 16 decimals keep what matters and hide cos(pi/2) = 6e-17; adding zero turns -0.0 into 0.0.
    rounded = round(float(value), 16) + 0.0
    return repr(int(rounded)) if rounded == int(rounded) else repr(rounded)


_QUARTER = math.pi / 2

PUMA560_ROWS = (
    DHRow(alpha=0.0, a=0.0, d=0.0),
    DHRow(alpha=-_QUARTER, a=0.0, d=0.0),
    DHRow(alpha=0.0, a=0.7, d=0.1),
    DHRow(alpha=-_QUARTER, a=0.1, d=0.7),
    DHRow(alpha=_QUARTER, a=0.0, d=0.0),
    DHRow(alpha=-_QUARTER, a=0.0, d=0.0),
)
"""The paper's arm: a2 = 0.7, a3 = 0.1, d3 = 0.1, d4 = 0.7 m."""

PUMA560_COLOURS = {
    "base": (0.32, 0.35, 0.39, 1.0),
    "body": (0.90, 0.89, 0.85, 1.0),
    "joint": (0.20, 0.34, 0.50, 1.0),
    "tool": (0.93, 0.36, 0.08, 1.0),
}

_ALONG_X = (0.0, _QUARTER, 0.0)
_ALONG_Y = (_QUARTER, 0.0, 0.0)

# The paper puts the tool point at the wrist centre, so the nozzle's tip has to be there: the nozzle
# swings between the cheeks of a fork, and points back into it when theta5 = 0. The upper arm stands
# outboard of the plane d3 in which the forearm moves, as on the real arm, and so the forearm passes
# it on the inside.
PUMA560_SHAPES = (
    # Frame 0, z up at shoulder height: pedestal.
    Shape(0, (0.17, 0.04), (0.0, 0.0, -0.68), colour="base"),
    Shape(0, (0.095, 0.50), (0.0, 0.0, -0.42), colour="base"),
    # Frame 1 turns about the column: shoulder block, and the housing of joint 2 along y1.
    Shape(1, (0.105, 0.09), (0.0, 0.0, -0.125), colour="joint"),
    Shape(1, (0.18, 0.18, 0.10), (0.0, 0.0, -0.04), colour="body"),
    Shape(1, (0.10, 0.34), (0.0, -0.02, 0.0), _ALONG_Y, colour="body"),
    # Frame 2, x2 along the upper arm, z2 along the shoulder axis.
    Shape(2, (0.115, 0.10), (0.0, 0.0, 0.20), colour="joint"),
    Shape(2, (0.70, 0.17, 0.085), (0.35, 0.0, 0.20), colour="body"),
    Shape(2, (0.20, 0.12, 0.085), (-0.12, 0.0, 0.20), colour="body"),
    Shape(2, (0.085, 0.085), (0.70, 0.0, 0.20), colour="body"),
    # Frame 3, forearm along y3 at x3 = a3: elbow, tail with the wrist motors, beam, tube.
    Shape(3, (0.075, 0.206), (0.0, 0.0, 0.052), colour="joint"),
    Shape(3, (0.17, 0.16, 0.09), (0.055, 0.0, 0.0), colour="body"),
    Shape(3, (0.10, 0.52, 0.085), (0.10, 0.16, 0.0), colour="body"),
    Shape(3, (0.042, 0.06), (0.10, 0.45, 0.0), _ALONG_Y, colour="joint"),
    # Frame 4, z4 along the forearm, y4 along the wrist's bending axis: roll tube and fork.
    Shape(4, (0.035, 0.08), (0.0, 0.0, -0.20), colour="body"),
    Shape(4, (0.06, 0.128, 0.03), (0.0, 0.0, -0.16), colour="body"),
    Shape(4, (0.045, 0.012, 0.16), (0.0, 0.058, -0.08), colour="body"),
    Shape(4, (0.045, 0.012, 0.16), (0.0, -0.058, -0.08), colour="body"),
    Shape(4, (0.028, 0.016), (0.0, 0.058, 0.0), _ALONG_Y, colour="joint"),
    Shape(4, (0.028, 0.016), (0.0, -0.058, 0.0), _ALONG_Y, colour="joint"),
    # Frame 5, z5 the bending axis, y5 the approach direction: the bow that carries the nozzle.
    Shape(5, (0.010, 0.09, 0.010), (0.0, -0.04, 0.045), colour="joint"),
    Shape(5, (0.010, 0.09, 0.010), (0.0, -0.04, -0.045), colour="joint"),
    Shape(5, (0.03, 0.012, 0.10), (0.0, -0.085, 0.0), colour="joint"),
    # Frame 6, z6 the approach direction: nozzle with its tip at the origin; the block on its side
    # shows theta6.
    Shape(6, (0.032, 0.045), (0.0, 0.0, -0.112), colour="tool"),
    Shape(6, (0.020, 0.07), (0.0, 0.0, -0.060), colour="tool"),
    Shape(6, (0.008, 0.028), (0.0, 0.0, -0.014), colour="tool"),
    Shape(6, (0.03, 0.022), (0.032, 0.0, -0.112), _ALONG_X, colour="base"),
)
"""What the arm is drawn as."""

PUMA560_COLLISIONS = (
    *(shape for shape in PUMA560_SHAPES if shape.link <= 3),
    # As drawn, but the tip ends as far behind the tool point as it is wide: at a tilt of 45 degrees
    # no point of it is ahead of the tool point, so that a standoff of 5 mm is free.
    Shape(6, (0.032, 0.045), (0.0, 0.0, -0.112)),
    Shape(6, (0.020, 0.07), (0.0, 0.0, -0.060)),
    Shape(6, (0.008, 0.02), (0.0, 0.0, -0.018)),
)
"""What can collide: base to forearm as drawn, and a nozzle."""

PUMA560_WITHOUT = (4, 5)
"""Fork and bow: no real wrist has its tool point between its pivots, 28 mm wide; those of the
drawing would be inside every surface that is treated."""

PUMA560_COMMENT = (
    "The paper gives the kinematics alone. Shapes, drawn and for collisions, are ours: base to "
    "link3 collide as drawn, link6 as a nozzle that ends 8 mm behind the tool point. The fork and "
    "the bow (link4, link5) are drawn around the tool point, where no tool could work, and are "
    'without collision shapes on purpose: collision="none".'
)


def puma560_urdf() -> str:
    """Return the text of `robots/arms/puma560.urdf`; limits are those of the paper's set 1."""
    limits = [(-180.0, 180.0)] * len(PUMA560_ROWS)
    return dh_urdf(
        "puma560",
        PUMA560_ROWS,
        limits,
        PUMA560_SHAPES,
        PUMA560_COLOURS,
        PUMA560_COLLISIONS,
        PUMA560_WITHOUT,
        PUMA560_COMMENT,
    )


if __name__ == "__main__":
    PUMA560_URDF.write_text(puma560_urdf(), encoding="utf-8")
