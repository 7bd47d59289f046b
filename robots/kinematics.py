"""Where the tool is: Pinocchio's frame placements, the authority for everything else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from coverable.arrays import Array
from coverable.errors import ArgumentError
from robots.robot import Robot


@dataclass(frozen=True, eq=False, slots=True)
class JointFrames:
    """Where the frames of all joints are, m times; index 0 is the root frame itself."""

    rotations: Array
    """(m, n + 1, 3, 3)"""
    points: Array
    """(m, n + 1, 3) m."""


class Kinematics:
    """Tool point, approach axis and their Jacobians of one robot, evaluated by Pinocchio.

    Holds Pinocchio's working memory, so use one per thread.

    Example:
        >>> from coverable import load_robot
        >>> point, axis = Kinematics(load_robot("puma560")).tool([0, 0, 0, 0, 0, 0])
        >>> point.round(6).tolist(), axis.round(6).tolist()
        ([0.8, 0.1, -0.7], [0.0, 0.0, -1.0])
    """

    def __init__(self, robot: Robot) -> None:
        """Create the working memory for `robot`."""
        self.robot = robot
        self._model = robot.model
        self._data = robot.model.createData()
        self._frame = robot.tool_frame_id
        self._approach = robot.approach_axis
        placement = self._data.oMf[self._frame]
        self._translation = placement.translation  # live views: looked up once, copied when kept
        self._rotation = placement.rotation
        self._pose = _pose_view(placement)
        self._twists = self._data.J.T  # (n, 6), one behind another in memory

    def configuration(self, q: ArrayLike) -> Array:
        """Pinocchio's configuration vector (nq,) for n real joint values (rad or m)."""
        values = np.ascontiguousarray(q, dtype=float)
        if values.shape != (self.robot.n,):
            raise ArgumentError(f"q must have shape ({self.robot.n},), got {values.shape}")
        return values

    def tool(self, q: ArrayLike) -> tuple[Array, Array]:
        """Tool point (3,) m and unit approach axis (3,) in the root frame, see `Robot`."""
        pin.forwardKinematics(self._model, self._data, self.configuration(q))
        pin.updateFramePlacement(self._model, self._data, self._frame)
        return self._translation.copy(), self._rotation @ self._approach

    def tools(self, q: ArrayLike) -> tuple[Array, Array]:
        """Tool points (m, 3) m and unit approach axes (m, 3) at configurations q (m, n).

        Example:
            >>> from coverable import load_robot
            >>> points, axes = Kinematics(load_robot("puma560")).tools(np.zeros((4, 6)))
            >>> points.shape, axes.shape
            ((4, 3), (4, 3))
        """
        return self.held(q)[:2]

    def held(self, q: ArrayLike) -> tuple[Array, Array, Array]:
        """`tools`, and the reference axes (m, 3) of the TCP, in the root frame."""
        poses = list[bytes]()
        for row in self._configurations(q):
            pin.forwardKinematics(self._model, self._data, row)
            pin.updateFramePlacement(self._model, self._data, self._frame)
            poses.append(self._pose.tobytes())
        points, rotations = _points_and_rotations(poses)
        return points, rotations @ self._approach, rotations @ self.robot.reference_axis

    def rotation(self, q: ArrayLike) -> Array:
        """(3, 3) axes of the TCP's frame, as columns, in the root frame, at q (n,).

        Example:
            >>> from coverable import load_robot
            >>> rotation = Kinematics(load_robot("puma560")).rotation(np.zeros(6))
            >>> np.allclose(rotation, np.diag([1.0, -1.0, -1.0]))
            True
        """
        pin.forwardKinematics(self._model, self._data, self.configuration(q))
        pin.updateFramePlacement(self._model, self._data, self._frame)
        return self._rotation.copy()

    def joints(self, q: ArrayLike) -> JointFrames:
        """Frames of the joints in the root frame at configurations q (m, n).

        Example:
            >>> from coverable import load_robot
            >>> Kinematics(load_robot("puma560")).joints(np.zeros((4, 6))).points.shape
            (4, 7, 3)
        """
        rows = self._configurations(q)
        count = self.robot.n + 1
        frames = JointFrames(np.empty((len(rows), count, 3, 3)), np.empty((len(rows), count, 3)))
        first, second = self._data.oMi[0], self._data.oMi[1]
        rotations = _joints_view(first.rotation, second.rotation, count)
        translations = _joints_view(first.translation, second.translation, count)
        for k, row in enumerate(rows):
            pin.forwardKinematics(self._model, self._data, row)
            frames.rotations[k] = rotations
            frames.points[k] = translations
        return frames

    def twists(self, q: ArrayLike) -> Array:
        """Unit twists (m, 6, n) of the joints at configurations q (m, n), in the root frame.

        Column j is what joint j alone does to the root frame's origin: its velocity, 1/s times m,
        then the angular velocity.
        """
        rows = self._configurations(q)
        columns = np.empty((len(rows), 6, self.robot.n))
        for k, row in enumerate(rows):
            # Pinocchio flattens a single column.
            columns[k] = pin.computeJointJacobians(self._model, self._data, row).reshape(6, -1)
        return columns

    def tools_and_twists(self, q: ArrayLike) -> tuple[Array, Array, Array]:
        """`tools` and `twists` at once, which takes less time."""
        poses, columns = list[bytes](), list[bytes]()
        for row in self._configurations(q):
            pin.computeJointJacobians(self._model, self._data, row)  # it places the joints too
            pin.updateFramePlacement(self._model, self._data, self._frame)
            # Copied as bytes, and made arrays of at once: half the time of a row of an array each.
            poses.append(self._pose.tobytes())
            columns.append(self._twists.tobytes())
        points, rotations = _points_and_rotations(poses)
        twists = np.frombuffer(bytearray().join(columns)).reshape(-1, self.robot.n, 6)
        return points, rotations @ self._approach, twists.transpose(0, 2, 1)

    def _configurations(self, q: ArrayLike) -> Array:
        """Pinocchio's configuration vectors (m, nq) for joint values q (m, n)."""
        rows = np.ascontiguousarray(q, dtype=float)
        if rows.ndim != 2 or rows.shape[1] != self.robot.n:
            raise ArgumentError(f"q must have shape (m, {self.robot.n}), got {rows.shape}")
        return rows

    def jacobians(self, q: ArrayLike) -> tuple[Array, Array]:
        """Derivatives (3, n) of tool point and of approach axis by q."""
        jacobian = pin.computeFrameJacobian(
            self._model,
            self._data,
            self.configuration(q),
            self._frame,
            pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        ).reshape(6, self.robot.n)  # Pinocchio flattens a single column
        pin.updateFramePlacement(self._model, self._data, self._frame)
        axis = self._rotation @ self._approach
        # w x a = [a]x^T w for each column w; `np.cross` takes longer than all the rest.
        return jacobian[:3].copy(), pin.skew(axis).T @ jacobian[3:]


def _joints_view(first: Array, second: Array, count: int) -> Array:
    """One live view (count, ...) of the same member of all of Pinocchio's joint placements.

    They lie one behind another in a `std::vector`; copied one by one they take longer than the
    forward kinematics.
    """
    start, behind = (view.__array_interface__["data"][0] for view in (first, second))
    shape, strides = (count, *first.shape), (behind - start, *first.strides)
    return np.lib.stride_tricks.as_strided(first, shape, strides, writeable=False)


def _pose_view(placement: pin.SE3) -> Array:
    """A live view (12,) of a placement: the columns of its rotation, then its translation."""
    rotation, translation = placement.rotation, placement.translation
    start, behind = (view.__array_interface__["data"][0] for view in (rotation, translation))
    column = rotation.itemsize
    if behind - start != 9 * column or rotation.strides != (column, 3 * column):
        raise ImportError(
            "this version of Pinocchio stores placements in another layout than expected"
        )
    return np.lib.stride_tricks.as_strided(rotation, (12,), (column,), writeable=False)


def _points_and_rotations(poses: list[bytes]) -> tuple[Array, Array]:
    """Translations (m, 3) and rotations (m, 3, 3) of copies of what `_pose_view` shows."""
    values = np.frombuffer(bytearray().join(poses)).reshape(-1, 12)
    rotations = values[:, :9].reshape(-1, 3, 3).transpose(0, 2, 1)
    return values[:, 9:].copy(), np.ascontiguousarray(rotations)


def configuration_near(
    kinematics: Kinematics,
    q: Array,
    point: Array,
    axis: Array,
    steps: int,
    close: float,
) -> Array | None:
    """The configuration near q (n,) with tool point and axis there; None where none is found.

    Newton's method with the shortest steps, clipped to the limits.

    Args:
        kinematics: of the arm.
        q: (n,) rad or m, where to begin.
        point: (3,) m, of the tool.
        axis: (3,) unit, its approach axis.
        steps: at most so many.
        close: m of the tool point, and 1 of the axis, how far it may be off.
    """
    robot = kinematics.robot
    for _ in range(steps):
        at, along = kinematics.tool(q)
        missed = np.concatenate([point - at, axis - along])
        if np.abs(missed).max() < close:
            return q
        rows = np.concatenate(kinematics.jacobians(q))
        step = np.linalg.lstsq(rows, missed, rcond=1e-6)[0]
        q = np.clip(q + step, robot.lower, robot.upper)
    return None
