"""Where an arm stands in the world, and its tool centre point: both are put into its model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pinocchio as pin

TCP = "coverable tcp"  # name of its frame in a model too


def place_base(model: pin.Model, base: NDArray[np.float64]) -> None:
    """Put the root link of a model at the pose `base` (4, 4) in the world; changes the model."""
    import pinocchio as pin

    place = pin.SE3(base)
    for joint in range(1, model.njoints):
        if model.parents[joint] == 0:
            model.jointPlacements[joint] = place * model.jointPlacements[joint]
    for number in range(1, model.nframes):  # frame 0 is the world
        if model.frames[number].parentJoint == 0:
            model.frames[number].placement = place * model.frames[number].placement


def place_tcp(model: pin.Model, tool: str, tcp: NDArray[np.float64]) -> None:
    """Add the tool centre point to a model, at the pose `tcp` (4, 4) in the link `tool`."""
    import pinocchio as pin

    number = model.getFrameId(tool, pin.FrameType.BODY)
    link = model.frames[number]
    place = link.placement * pin.SE3(tcp)
    frame = pin.Frame(TCP, link.parentJoint, number, place, pin.FrameType.OP_FRAME)
    model.addFrame(frame, False)  # without an inertia of its own
