"""URDF texts that the tests of `robots` build, and an independent forward kinematics for them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from coverable import Robot, list_robots, load_robot

FREE = (-float("inf"), float("inf"))

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


def random_arm(rng: np.random.Generator) -> str:
    """A serial chain of 1 to 9 joints of every kind, with any axes, origins and limits."""
    n = int(rng.integers(1, 10))
    joints = []
    for i in range(1, n + 1):
        kinds = ["revolute", "continuous", "prismatic"] + ["fixed"] * (i > 1)
        lower = float(rng.uniform(-4, 3))
        joints.append(
            joint(
                i,
                str(rng.choice(kinds)),
                rng.uniform(-0.5, 0.5, 3),
                rng.uniform(-np.pi, np.pi, 3),
                # Close to a coordinate axis now and then: the rotation onto it must not lose that.
                rng.normal(size=3) if rng.random() < 0.7 else [1e-7, 0, 1] * rng.normal(size=3),
                (lower, lower + float(rng.uniform(0.1, 3))),
            )
        )
    joints[0] = joint(1, "revolute", axis=(0, 0, -1)) if "fixed" in joints[0] else joints[0]
    return arm(joints)


def load_text(folder: Path, text: str, **options: object) -> Robot:
    path = folder / "test_arm.urdf"
    path.write_text(text, encoding="utf-8")
    return load_robot(path, **options)  # type: ignore[arg-type]


def random_q(robot: Robot, rng: np.random.Generator, turns: float = 2.0) -> NDArray[np.float64]:
    """A configuration inside the limits; free joints turn several times."""
    far = turns * 2 * np.pi
    lower = np.where(np.isfinite(robot.lower), robot.lower, -far)
    upper = np.where(np.isfinite(robot.upper), robot.upper, far)
    return rng.uniform(lower, upper)
