"""Arms that hold the part under a fixed tool, and the mirrored problem: the arm relabelled."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from feasibility import Task
from robots import Robot, load_robot
from surfaces import Cells, cylinder, plane, sphere

ARMS = {"puma560": "link6", "ur5": "tool0", "kinova": "j2s6s200_end_effector"}
JOINT = (
    '<joint name="{0}" type="{1}"><parent link="l{2}"/><child link="l{3}"/>'
    '<origin xyz="{4}" rpy="{5}"/><axis xyz="{6}"/>'
    '<limit lower="{7!r}" upper="{8!r}" effort="1" velocity="1"/></joint>'
)


class Held(NamedTuple):
    """One question, asked in two ways."""

    holding: Robot
    """Seen from its flange, which carries the part; the tool stands in the world."""
    mirrored: Robot
    """The same joints as an arm that carries the tool, over a part at rest."""
    cells: Cells
    task: Task


def _text(values: NDArray[np.float64]) -> str:
    return " ".join(repr(float(value)) for value in values)


def mirrored_urdf(robot: Robot, tool: pin.SE3) -> str:
    """An arm whose root is the flange of `robot`, and whose last link is the world with the tool.

    With tool frame X = P1 J1(q1) P2 J2(q2) .. Pn Jn(qn) E in the world, the world is in the frame
    of the flange at E^-1 Jn(-qn) Pn^-1 .. J1(-q1) P1^-1, and J(-q) about an axis is J(q) about the
    opposite one.
    """
    model, n = robot.model, robot.n
    ends = [model.frames[robot.tool_link_id].placement.inverse()]
    ends += [model.jointPlacements[j].inverse() for j in range(n, 0, -1)]
    ends[-1] = ends[-1] * tool
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    joints = []
    for k in range(n):
        j = n - k
        local = pin.getJointJacobian(model, data, j, pin.ReferenceFrame.LOCAL).reshape(6, n)
        slides = robot.prismatic[j - 1]
        axis = -(local[:3, j - 1] if slides else local[3:, j - 1])
        kind = robot.joint_kinds[j - 1]
        free = kind == "continuous"
        low, high = (0.0, 0.0) if free else (robot.lower[j - 1], robot.upper[j - 1])
        xyz, rpy = ends[k].translation, pin.rpy.matrixToRpy(ends[k].rotation)
        names = robot.joint_names[j - 1], kind, k, k + 1
        joints.append(JOINT.format(*names, _text(xyz), _text(rpy), _text(axis), low, high))
    last = ends[-1]
    xyz, rpy = _text(last.translation), _text(pin.rpy.matrixToRpy(last.rotation))
    joints.append(
        f'<joint name="end" type="fixed"><parent link="l{n}"/><child link="tool"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/></joint>'
    )
    links = "".join(f'<link name="l{k}"/>' for k in range(n + 1))
    return f'<robot name="mirrored">{links}<link name="tool"/>{"".join(joints)}</robot>'


def held_case(seed: int, folder: Path) -> Held:
    """A random arm, part, tool and task."""
    rng = np.random.default_rng(seed)
    name = str(rng.choice(list(ARMS)))
    arm = load_robot(name)
    root = arm.link_names[0]
    # The tool stands where the arm can bring its flange to, and looks back at it.
    q = np.clip(rng.uniform(-2.0, 2.0, arm.n), arm.lower, arm.upper)
    data = arm.model.createData()
    pin.framesForwardKinematics(
        arm.model, data, pin.integrate(arm.model, pin.neutral(arm.model), q)
    )
    flange = data.oMf[arm.tool_link_id]
    turned = pin.SE3(pin.exp3(np.array([np.pi, 0, 0]) + rng.normal(0, 0.3, 3)), np.zeros(3))
    tool = flange * pin.SE3(np.eye(3), np.array([0, 0, 0.1])) * turned
    limits = np.column_stack([np.maximum(arm.lower, q - 1.5), np.minimum(arm.upper, q + 1.5)])
    narrow = dict(zip(arm.joint_names, limits, strict=True))
    holding = load_robot(
        name, tool_frame=root, tcp=tool, approach_axis=(0, 0, 1), surface_link=ARMS[name],
        limits=narrow,
    )  # fmt: skip
    path = folder / f"mirrored{seed}.urdf"
    path.write_text(mirrored_urdf(arm, tool), encoding="utf-8")
    mirrored = load_robot(str(path), tool_frame="tool", limits=narrow)
    size = float(rng.uniform(0.05, 0.3))
    at = {"position": (0, 0, 0.1), "side": "outside"}
    part = (
        plane((-size, size), (-size / 2, size / 2), **at),
        sphere(size, (5, 60), (0, 180), position=(0, 0, 0.1 - size), side="outside"),
        cylinder(size, (-50, 50), (-0.1, 0.1), position=(0, 0, 0.1 - size), rpy_deg=(0, -90, 0),
                 side="outside"),
    )[int(rng.integers(3))]  # fmt: skip
    cells = part.cells(*map(int, rng.integers(2, 5, 2)))
    return Held(holding, mirrored, cells, Task(0.005, float(rng.uniform(10, 60))))
