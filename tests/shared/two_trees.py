"""Arms with positioners as one URDF each, and where their links are by the tree's own model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from robots import Robot, list_robots
from robots.urdf import check_urdf

FIXED = '<joint name="{0}" type="fixed"><parent link="{1}"/><child link="{2}"/>{3}</joint>'
MOVING = (
    '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/>{4}'
    '<axis xyz="{5}"/><limit lower="{6}" upper="{7}" effort="1" velocity="{8}"/></joint>'
)


def origin(xyz: str, rpy: str = "0 0 0") -> str:
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def cell_text() -> str:
    """A UR5 on a rail, beside a table that turns on one that tilts."""
    path = next(info.urdf for info in list_robots() if info.name == "ur5")
    checked = check_urdf(path)
    arm = checked.text.replace("<robot name=", "<robot name=").rsplit("</robot>", 1)[0]
    links = ("hall", "carriage", "cradle", "turntable", "jig")
    more = [f'<link name="{name}"/>' for name in links]
    more += [
        MOVING.format(
            "rail", "prismatic", "hall", "carriage", origin("0 -1 0.3", "0 0.1 0.2"), "1 0 0",
            -1.0, 1.5, 0.7,
        ),
        FIXED.format("on rail", "carriage", checked.root, origin("0 0 0.1", "0 0 1")),
        MOVING.format(
            "tilt", "revolute", "hall", "cradle", origin("0.7 0 0.4", "0.2 0 0"), "0 1 0.1",
            -1.0, 1.2, 1.1,
        ),
        MOVING.format(
            "turn", "continuous", "cradle", "turntable", origin("0 0 0.2"), "0 0 -1", 0, 0, 2.0
        ),
        FIXED.format("clamped", "turntable", "jig", origin("0.1 0 0.05", "0.3 0.2 0.1")),
    ]  # fmt: skip
    return arm + "\n".join(more) + "</robot>"


def write(folder: Path, text: str) -> str:
    path = folder / "cell.urdf"
    path.write_text(text, encoding="utf-8")
    return str(path)


class Tree:
    """The whole tree of a URDF, by Pinocchio, with joints by name."""

    def __init__(self, path: str) -> None:
        self.model = pin.buildModelFromXML(check_urdf(path).text)
        self.data = self.model.createData()

    def configuration(self, values: dict[str, float]) -> NDArray[np.float64]:
        """Pinocchio's configuration; joints without a value are at zero."""
        v = np.zeros(self.model.nv)
        for name, value in values.items():
            v[self.model.joints[self.model.getJointId(name)].idx_v] = value
        return pin.integrate(self.model, pin.neutral(self.model), v)

    def relative(self, link: str, tool: str, values: dict[str, float]) -> NDArray[np.float64]:
        """(4, 4) the frame of one link in that of another."""
        pin.framesForwardKinematics(self.model, self.data, self.configuration(values))
        first, second = (self.model.getFrameId(n, pin.FrameType.BODY) for n in (link, tool))
        return self.data.oMf[first].actInv(self.data.oMf[second]).homogeneous

    def relative_jacobian(
        self, link: str, tool: str, values: dict[str, float], names: tuple[str, ...]
    ) -> NDArray[np.float64]:
        """(6, n) twist of `tool` against `link`, in the frame of `tool`, for joints by name."""
        q = self.configuration(values)
        pin.computeJointJacobians(self.model, self.data, q)
        pin.framesForwardKinematics(self.model, self.data, q)
        first, second = (self.model.getFrameId(n, pin.FrameType.BODY) for n in (link, tool))
        of_link, of_tool = (
            pin.getFrameJacobian(self.model, self.data, f, pin.ReferenceFrame.LOCAL)
            for f in (first, second)
        )
        across = self.data.oMf[second].actInv(self.data.oMf[first]).toActionMatrix()
        columns = [self.model.joints[self.model.getJointId(name)].idx_v for name in names]
        return (of_tool - across @ of_link)[:, columns]


def random_values(robot: Robot, rng: np.random.Generator) -> NDArray[np.float64]:
    """(n,) inside the limits; a joint without limits turns three times."""
    low = np.where(np.isfinite(robot.lower), robot.lower, -6 * np.pi)
    high = np.where(np.isfinite(robot.upper), robot.upper, 6 * np.pi)
    return rng.uniform(low, high)
