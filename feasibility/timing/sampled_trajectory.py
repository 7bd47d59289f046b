"""A trajectory: what each joint does at sampled times, and in between.

Between samples the joints move on the cubic spline through them that is at rest at both ends and
twice continuously differentiable. A ROS `joint_trajectory_controller` makes quintics of positions,
velocities and accelerations, or cubics of positions and velocities: both are this spline again,
since its pieces have these very values at their ends, and no other cubic or quintic has.

How far it is from the straight lines between samples: on a stretch with samples a and b at its
ends let q'' be the second derivative by the share t of the stretch. Both the motion and the
straight line a + t (b - a) go through a and b, so they are at most max |q''| / 8 apart, joint by
joint. What of q'' points along b - a only changes how fast the line is run: as long as that part is
at most 2 |b - a|, the motion runs along it without going back, and is off the line by the rest of
q'' alone.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from coverable.arrays import Array, Ints, Mask
from coverable.errors import ArgumentError
from feasibility.verdict import Walk
from robots.chain import moved_by_joints
from robots.robot import Robot

ROUNDING = 1e-12  # [rad] or [m]


def deviations(q: Array, seconds: Array) -> Array:
    """(m - 1, n) how far each joint may be from the straight lines between m samples.

    Args:
        q: (m, n) rad or m.
        seconds: (k, m - 1, n) values by the square of a stretch, between which q'' stays.
    """
    ahead = np.diff(q, axis=0)
    length = np.sqrt((ahead**2).sum(axis=1, keepdims=True))
    with np.errstate(invalid="ignore", divide="ignore"):
        along = np.where(length > 0.0, ahead / length, 0.0)
    share = (seconds * along).sum(axis=2, keepdims=True)
    onwards = np.abs(share).max(axis=0) <= 2.0 * length
    beside = np.where(onwards, seconds - share * along, seconds)
    return np.asarray(np.abs(beside).max(axis=0) / 8.0 + ROUNDING)


@dataclass(frozen=True, eq=False, slots=True)
class Trajectory:
    """k samples of a motion of n joints, from rest to rest.

    Raises:
        ArgumentError: the arrays do not fit together, a number is not finite, or the times do not
            rise from 0 or later.
    """

    joint_names: tuple[str, ...]
    """The n joints."""
    time: Array
    """(k,) s, rising."""
    q: Array
    """(k, n) rad or m."""
    dq: Array
    """(k, n) rad/s or m/s."""
    ddq: Array
    """(k, n) rad/s^2 or m/s^2."""
    tool_speed: Array
    """(k,) m/s."""
    cell: Ints
    """(k,) flat index of the cell whose centre the tool point passes then; -1 in between."""
    collisions: tuple[str, ...] = ()
    """What the replay of the motion checked: some of self, surface and scene."""
    working: Mask | None = None
    """(k,) at which samples the tool works, neither lifted nor beyond the border, nor on its way to
    the surface; None for all."""

    def __post_init__(self) -> None:
        """Copy, check and write-protect the arrays."""
        object.__setattr__(self, "joint_names", tuple(self.joint_names))
        kinds = {"cell": np.int64, "working": bool}
        for name in ("time", "q", "dq", "ddq", "tool_speed", "cell", "working"):
            if getattr(self, name) is not None:
                array = np.array(getattr(self, name), dtype=kinds.get(name, float))
                array.flags.writeable = False
                object.__setattr__(self, name, array)
        faults = self._faults()
        if faults:
            raise ArgumentError(faults, "trajectory")

    def _faults(self) -> list[str]:
        """All that is wrong with the arrays."""
        k, n = len(self.time), len(self.joint_names)
        faults = []
        if n == 0 or len(set(self.joint_names)) < n:
            faults.append("there must be at least one joint, and no name twice")
        if self.time.ndim != 1 or k == 0:
            faults.append("there must be at least one sample")
        for name in ("q", "dq", "ddq", "tool_speed", "cell", "working"):
            shape = (k, n) if name in ("q", "dq", "ddq") else (k,)
            array = getattr(self, name)
            if array is not None and array.shape != shape:
                faults.append(f"{name} must have shape {shape}, got {array.shape}")
            elif array is not None and not np.isfinite(array).all():
                faults.append(f"{name} must hold finite numbers")
        if not np.isfinite(self.time).all() or not (self.time >= 0.0).all():
            faults.append("times must be finite and not negative (seconds)")
        elif not (np.diff(self.time) > 0.0).all():
            faults.append("times must rise from sample to sample")
        if (self.cell < -1).any():
            faults.append("cells must be flat indices, or -1 in between")
        return faults

    @staticmethod
    def through(robot: Robot, time: Array, q: Array, cell: Ints) -> "Trajectory":
        """The motion through joints q (k, n) at times (k,) s; at rest where there is one."""
        dq, ddq = np.zeros_like(q), np.zeros_like(q)
        if len(time) > 1:
            motion = CubicSpline(time, q, bc_type="clamped")
            dq, ddq = motion(time, 1) + 0.0, motion(time, 2) + 0.0
            dq[[0, -1]] = 0.0
        return Trajectory(robot.joint_names, time, q, dq, ddq, tool_speeds(robot, q, dq), cell)

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.time)

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the last."""
        return float(self.time[-1] - self.time[0])

    @property
    def tool_way(self) -> float:
        """m, length of the tool point's path, from its speed at the samples (trapezoidal rule)."""
        return float(np.trapezoid(self.tool_speed, self.time))

    @property
    def walk(self) -> Walk:
        """The samples as a motion of straight lines, which a replay can check."""
        return Walk(q=self.q, cell=self.cell)

    @property
    def over(self) -> slice:
        """The samples from the first passage of a cell's centre to the last."""
        marks = np.flatnonzero(self.cell >= 0)
        return slice(int(marks[0]), int(marks[-1]) + 1) if len(marks) else slice(0)

    def at(self, time: Array, order: int = 0) -> Array:
        """(k, n) joints at times (k,) s, or a derivative of them; at rest outside the motion."""
        if len(self) == 1:
            return np.tile(0.0 if order else self.q, (len(time), self.q.shape[1] if order else 1))
        inside = np.clip(time, self.time[0], self.time[-1])
        return np.asarray(self.spline(inside, order))

    @property
    def spline(self) -> CubicHermiteSpline:
        """The motion between samples, of which there are two at least."""
        return CubicHermiteSpline(self.time, self.q, self.dq)

    def between(self, places: int) -> Walk:
        """The motion at so many places of each piece, as straight lines that a replay can check."""
        share = np.arange(places) / places
        inner = (self.time[:-1, None] + share * np.diff(self.time)[:, None]).ravel()
        q = np.vstack([self.at(inner), self.q[-1:]])
        q[::places] = self.q
        cell = np.full(len(q), -1, dtype=np.int64)
        cell[::places] = self.cell
        return Walk(q=q, cell=cell)

    def off_lines(self, places: int) -> Array:
        """(m, n) how far each joint may be from the straight lines of `between`."""
        first, last = bends(self)
        share = (np.arange(places + 1) / places)[:, None]
        ends = first[:, None] + share * (last - first)[:, None]
        stretch = (np.diff(self.time) / places)[:, None, None] ** 2
        seconds = np.stack([ends[:, :-1] * stretch, ends[:, 1:] * stretch])
        return deviations(self.between(places).q, seconds.reshape(2, -1, self.q.shape[1]))

    def __repr__(self) -> str:
        """One line: joints, samples and seconds."""
        n = len(self.joint_names)
        return f"Trajectory({n} joints, {len(self)} samples, {self.duration:.2f} s)"


def bends(run: Trajectory) -> tuple[Array, Array]:
    """(k - 1, n) accelerations at the beginning and at the end of each piece, straight between."""
    cubic, square = run.spline.c[:2]  # by the time since the beginning of a piece
    return 2.0 * square, 2.0 * square + 6.0 * cubic * np.diff(run.time)[:, None]


def tool_speeds(robot: Robot, q: Array, slope: Array) -> Array:
    """(m,) m, how fast the tool point moves when the joints q (m, n) move at `slope` (m, n).

    By the search's own kinematics, as Pinocchio takes far longer.
    """
    velocity = np.zeros((3, len(q)))
    for by_joint, rate in zip(moved_by_joints(robot.chain, q), slope.T, strict=True):
        velocity += by_joint * rate
    return np.asarray(np.sqrt((velocity**2).sum(axis=0)))
