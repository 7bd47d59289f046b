"""A model as it is seen from one of its links, or why it cannot be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable_errors import Fault, close_matches
from robots.errors import RobotError
from robots.mounting.rerooting import joints_between, rerooted

if TYPE_CHECKING:
    import pinocchio as pin


class SeenFrom(NamedTuple):
    """The chain from a link to the tool."""

    model: pin.Model
    order: tuple[int, ...]
    """Which of the old joints, counted from 0, each joint is."""
    held: tuple[int, ...]
    """The others."""


def seen_from(model: pin.Model, link: str, tool: int, rest: NDArray[np.float64]) -> SeenFrom:
    """The chain from a link to the tool frame; the other joints are held.

    Args:
        model: of n joints.
        link: whose frame becomes the root frame.
        tool: index of the tool frame.
        rest: (n,) rad or m, where joints that lie elsewhere are held.

    Raises:
        RobotError: there is no such link, or no joint lies between it and the tool.
    """
    import pinocchio as pin

    body = pin.FrameType.BODY
    if not model.existFrame(link, body):
        links = [frame.name for frame in model.frames if frame.type == body]
        near = close_matches(link, links, most=3) or links[:20]
        what = f"there is no link {link!r}; did you mean {' or '.join(map(repr, near))}?"
        raise RobotError([Fault("surface_link", what)])
    inwards, outwards = joints_between(model, model.getFrameId(link, body), tool)
    order = tuple(int(model.joints[joint].idx_v) for joint in (*inwards, *outwards))
    if not order:
        what = (
            f"link {link!r} cannot carry the surface: no free joint lies between it and the tool; "
            f"load_robot(..., surface_link={link!r}) frees those that are held"
        )
        raise RobotError([Fault("surface_link", what)])
    held = tuple(number for number in range(model.nv) if number not in order)
    frame = model.frames[tool]
    chain = _locked(model, held, rest)
    ends = chain.getFrameId(link, body), chain.getFrameId(frame.name, frame.type)
    return SeenFrom(rerooted(chain, *ends), order, held)


def _locked(model: pin.Model, held: Sequence[int], rest: NDArray[np.float64]) -> pin.Model:
    """The model with some of its joints, counted from 0, held."""
    import pinocchio as pin

    if not held:
        return model
    q = pin.integrate(model, pin.neutral(model), rest)
    numbers = {model.joints[joint].idx_v: joint for joint in range(1, model.njoints)}
    return pin.buildReducedModel(model, [numbers[number] for number in held], q)
