"""The unit in which times of different machines and days compare: one FK call of Pinocchio."""

from __future__ import annotations

import time

import pinocchio as pin
from paper_cases import PAPER_CASES

UNIT = (
    "one pinocchio.forwardKinematics and updateFramePlacement of the tool from Python, on the "
    "PUMA 560 of paper/4a; least mean of many short blocks right before and after each table"
)


def pinocchio_fk_us(calls: int = 2_000, blocks: int = 50) -> float:
    """Microseconds of one call of Pinocchio's FK with the tool frame, from Python.

    The blocks take a millisecond, so that most are left in peace by whatever else runs; the least
    mean of a block counts.
    """
    model = PAPER_CASES["4a"].robot().model
    data, q = model.createData(), pin.neutral(model)
    frame = model.nframes - 1
    taken = []
    for _ in range(blocks):
        began = time.perf_counter()
        for _ in range(calls):
            pin.forwardKinematics(model, data, q)
            pin.updateFramePlacement(model, data, frame)
        taken.append(time.perf_counter() - began)
    return 1e6 * min(taken) / calls
