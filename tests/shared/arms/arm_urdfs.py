"""URDF texts that the tests of `robots` build, and an independent forward kinematics for them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from coverable import Robot, list_robots, load_robot

Floats = NDArray[np.float64]
FREE = (-float("inf"), float("inf"))
RIGHT_ANGLES = (-np.pi / 2, 0.0, np.pi / 2, np.pi)

# Six unlike arms: of 6 and 7 joints, continuous ones, a tool axis other than z, on a held body.
SIX = ("puma560", "ur5", "panda", "kinova", "talos_arm", "baxter_left")
UNLIKE = (*SIX, "tiago on its lift")


def unlike(name: str) -> Robot:
    """An arm of `UNLIKE`; the last has a prismatic joint, which the library holds."""
    if name in SIX:
        return load_robot(name)
    info = next(info for info in list_robots() if info.name == "tiago")
    robot = load_robot(info.urdf, tool_frame=info.tool_frame, package_dirs=info.package_dirs)
    assert robot.prismatic.any()
    return robot


def joint(
    index: int,
    kind: str = "revolute",
    xyz: Sequence[float] = (0.0, 0.0, 0.0),
    rpy: Sequence[float] = (0.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    limits: tuple[float, float] = (-3.0, 3.0),
    extra: str = "",
) -> str:
    """`j<index>` from `l<index - 1>` to `l<index>`."""

    def text(values: Sequence[float]) -> str:
        return " ".join(repr(float(value)) for value in values)

    limit = f'<limit lower="{limits[0]!r}" upper="{limits[1]!r}" effort="1" velocity="1"/>'
    return (
        f'<joint name="j{index}" type="{kind}"><parent link="l{index - 1}"/>'
        f'<child link="l{index}"/><origin xyz="{text(xyz)}" rpy="{text(rpy)}"/>'
        + (f'<axis xyz="{text(axis)}"/>' if kind != "fixed" else "")
        + (limit if kind in ("revolute", "prismatic") else "")
        + extra
        + "</joint>"
    )


def arm(joints: Sequence[str], more: str = "") -> str:
    links = "".join(f'<link name="l{i}"/>' for i in range(len(joints) + 1))
    return f'<robot name="test_arm">{links}{"".join(joints)}{more}</robot>'


def random_joints(
    rng: np.random.Generator, least: int = 1, most: int = 8
) -> tuple[list[str], tuple[float, ...]]:
    """Joints of every kind, some at right angles, a fixed one at the end; and a tool axis."""
    n = int(rng.integers(least, most + 1))
    square = rng.random() < 0.5
    joints = []
    for i in range(1, n + 1):
        kind = str(rng.choice(["revolute", "continuous", "prismatic"], p=[0.6, 0.15, 0.25]))
        lower = float(rng.uniform(-4.0, 1.0))
        place = np.zeros(3) if rng.random() < 0.33 else rng.uniform(-0.5, 0.5, 3)
        turn = rng.choice(RIGHT_ANGLES, 3) if square else rng.uniform(-np.pi, np.pi, 3)
        axis = (0, 0, 1) if square else rng.normal(size=3)
        limits = FREE if kind == "continuous" else (lower, lower + float(rng.uniform(1.0, 7.0)))
        joints.append(joint(i, kind, place, turn, axis, limits))
    offset = np.zeros(3) if rng.random() < 0.3 else rng.uniform(-0.2, 0.2, 3)
    joints.append(joint(n + 1, "fixed", offset))
    return joints, (0.0, 0.0, 1.0) if square else tuple(rng.normal(size=3))


def random_arm(rng: np.random.Generator) -> str:
    return arm(random_joints(rng)[0])


def load_text(folder: Path, text: str, **options: object) -> Robot:
    path = folder / "test_arm.urdf"
    path.write_text(text, encoding="utf-8")
    return load_robot(path, **options)


def finite_limits(robot: Robot, far: float = 2.0 * np.pi) -> tuple[Floats, Floats]:
    """The limits (rad, m), and that far where there are none."""
    return tuple(np.nan_to_num([robot.lower, robot.upper], posinf=far, neginf=-far))


def random_q(robot: Robot, rng: np.random.Generator) -> Floats:
    """A configuration inside the limits; free joints turn several times."""
    return rng.uniform(*finite_limits(robot, 4.0 * np.pi))
