"""What the range of the roll leaves of a box, by two bounds: kernels.

The reference axis x of the tool is in a ball about the direction in the middle of cone and range,
wherever the target may be: with sines against x in place of levers, as for the axis. And over a
target at rest, with c the box's centre and g the gradient of roll there,

    |psi(q) - psi(c) - g . (q - c)| <= M / 2

with M of `feasibility.roadmap.motions.segment_bound` for the half widths h in place of the step,
and the largest tilt of the box. That holds for the roll that is reached from the centre without a
jump: the range is tested only where that cannot be another turn.
"""

from __future__ import annotations

import numpy as np

from coverable.kernels import kernel
from feasibility.roadmap.branch_and_bound.box_bounds import contract
from feasibility.roadmap.motions.roll_kernels import TURN, level, roll_gradient

ROUNDING = 1e-10  # [rad]
FLATTEST = 0.1  # [1] 1 + cos of a tilt beyond which roll is not looked at


@kernel
def rolls_over(arrays, places, part):
    """Is roll limited, and known over a part?"""
    return arrays.roll[1] < np.inf and places.radius[part, 2] < np.inf


@kernel
def roll_chord(arrays):
    """2 sin(Theta / 2) of the lemma of `box_contraction`."""
    tilt = 1.0 - 0.25 * min(arrays.cone_chord, 2.0) ** 2
    cosine = np.cos(0.5 * min(arrays.roll[1], np.pi))
    return 2.0 * np.sqrt(max(1.0 - tilt * cosine * cosine, 0.0))


@kernel
def unturned(target, toward, middle):
    """Set row 2 of a target (3, 3) to `toward`, turned back about row 1 by `middle`."""
    cosine, sine = np.cos(middle), np.sin(middle)
    b = target[1]
    target[2, 0] = cosine * toward[0] - sine * (b[1] * toward[2] - b[2] * toward[1])
    target[2, 1] = cosine * toward[1] - sine * (b[2] * toward[0] - b[0] * toward[2])
    target[2, 2] = cosine * toward[2] - sine * (b[0] * toward[1] - b[1] * toward[0])
    level(target)


@kernel
def length_of(vector):
    """The length of a vector (3,)."""
    return np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@kernel
def reference_rows(arrays, work, rows):
    """Derivatives (3, n) of the tool's reference axis in slot 1: z x x, 0 by a prismatic joint."""
    x, y, z = work.reference[1, 0], work.reference[1, 1], work.reference[1, 2]
    for j in range(work.axes.shape[1]):
        turns = 0.0 if arrays.chain.prismatic[j] else 1.0
        zx, zy, zz = work.axes[1, j, 0], work.axes[1, j, 1], work.axes[1, j, 2]
        rows[0, j] = turns * (zy * z - zz * y)
        rows[1, j] = turns * (zz * x - zx * z)
        rows[2, j] = turns * (zx * y - zy * x)


@kernel
def contract_roll(arrays, work, half, sine, g, low, high):
    """Cut the box, about slot 1, to where roll is in its range; False when nothing is left.

    Args:
        arrays, work: as everywhere; slot 1 holds the box's centre.
        half, sine: (n,) half widths, and sines against the axis.
        g: (n,) scratch.
        low, high: (n,) the box less its centre, cut in place.
    """
    turn, axis, paired, mixed = 0.0, 0.0, 0.0, 0.0
    for j in range(sine.shape[0]):
        if not arrays.chain.prismatic[j]:
            axis += sine[j] * half[j]
            paired += sine[j] * half[j] * turn
            mixed += half[j] * turn
            turn += half[j]
    chord = work.error[1, 1] + axis
    along = 2.0 - 0.5 * chord * chord
    off, most = work.error[1, 2], arrays.roll[1]
    if not along > FLATTEST:
        return True
    cosine = np.sqrt(0.5 * along)
    if not turn / cosine < TURN - most - abs(off):
        return True
    second = (2.0 * paired + mixed * chord) / along + turn * axis * chord / along
    most += 0.5 * second + ROUNDING
    roll_gradient(work.target, work.axis[1], work.axes[1], arrays.chain.prismatic, g)
    return contract(g, -most - off, most - off, low, high)
