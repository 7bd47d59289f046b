"""A trajectory: what each joint does at sampled times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coverable_errors import ArgumentError
from feasibility.verdict import Walk

Array = NDArray[np.float64]


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
    """(k, n) rad/s^2 or m/s^2; from the sample on, where it jumps."""
    tool_speed: Array
    """(k,) m/s."""
    cell: NDArray[np.int64]
    """(k,) flat index of the cell whose centre the tool point passes then; -1 in between."""

    def __post_init__(self) -> None:
        """Copy, check and write-protect the arrays."""
        object.__setattr__(self, "joint_names", tuple(self.joint_names))
        for name in ("time", "q", "dq", "ddq", "tool_speed", "cell"):
            array = np.array(getattr(self, name), dtype=np.int64 if name == "cell" else float)
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
        for name, shape in (
            ("q", (k, n)), ("dq", (k, n)), ("ddq", (k, n)), ("tool_speed", (k,)), ("cell", (k,))
        ):  # fmt: skip
            array = getattr(self, name)
            if array.shape != shape:
                faults.append(f"{name} must have shape {shape}, got {array.shape}")
            elif not np.isfinite(array).all():
                faults.append(f"{name} must hold finite numbers")
        if not np.isfinite(self.time).all() or not (self.time >= 0.0).all():
            faults.append("times must be finite and not negative (seconds)")
        elif not (np.diff(self.time) > 0.0).all():
            faults.append("times must rise from sample to sample")
        if (self.cell < -1).any():
            faults.append("cells must be flat indices, or -1 in between")
        return faults

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

    def __repr__(self) -> str:
        """One line: joints, samples and seconds."""
        n = len(self.joint_names)
        return f"Trajectory({n} joints, {len(self)} samples, {self.duration:.2f} s)"
