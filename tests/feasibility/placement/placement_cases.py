"""Feasible cases for three arms, and shifts that make them infeasible."""

from __future__ import annotations

import numpy as np

from feasibility.cases import Case
from feasibility.placement import AXES, Pose, Region

SHIFT, TURN_DEG = 0.3, 40.0  # [m], [deg] that a surface is moved by, at most

TEXTS = {
    "puma560 dome": """
        robot = { name = "puma560", limits = "set-1" }
        surface.kind = "sphere"
        surface.radius = 1.0
        surface.u_deg = [20, 80]
        surface.v_deg = [40, 130]
        surface.cells = [4, 5]
        task = { standoff = 0.005, cone_deg = 25 }
    """,
    "puma560 pipe": """
        robot = { name = "puma560", limits = "set-1" }
        surface.kind = "cylinder"
        surface.radius = 0.5
        surface.u_deg = [-40, 40]
        surface.v = [0.1, 0.6]
        surface.cells = [5, 4]
        task = { standoff = 0.005, cone_deg = 30 }
    """,
    "ur5 plate": """
        robot = { name = "ur5" }
        surface.kind = "plane"
        surface.u = [-0.25, 0.25]
        surface.v = [-0.2, 0.2]
        surface.cells = [5, 4]
        surface.position = [0.5, 0, 0.2]
        surface.side = "outside"
        task = { standoff = 0.02, cone_deg = 20 }
    """,
    "ur5 pipe": """
        robot = { name = "ur5" }
        surface.kind = "cylinder"
        surface.radius = 0.15
        surface.u_deg = [100, 260]
        surface.v = [-0.2, 0.2]
        surface.position = [0.65, 0, 0.3]
        surface.side = "outside"
        surface.cells = [5, 4]
        task = { standoff = 0.02, cone_deg = 20 }
    """,
    "panda plate": """
        robot = { name = "panda" }
        surface.kind = "plane"
        surface.u = [-0.2, 0.2]
        surface.v = [-0.2, 0.2]
        surface.cells = [4, 4]
        surface.position = [0.5, 0, 0.2]
        surface.side = "outside"
        task = { standoff = 0.02, cone_deg = 15 }
    """,
    "panda dome": """
        robot = { name = "panda" }
        surface.kind = "sphere"
        surface.radius = 0.2
        surface.u_deg = [5, 60]
        surface.v_deg = [100, 260]
        surface.position = [0.5, 0, 0.1]
        surface.side = "outside"
        surface.cells = [4, 5]
        task = { standoff = 0.02, cone_deg = 20 }
    """,
}


def placement_case(name: str) -> Case:
    """The case of that name, feasible as it stands."""
    return Case.from_toml(TEXTS[name], name=name)


def moved_away(case: Case, seed: int) -> Pose:
    """A pose up to 0.3 m and 40 degrees, along and about each axis, from where the surface is."""
    widths = np.array([SHIFT] * 3 + [TURN_DEG] * 3)
    own = np.array([*case.surface.position, *case.surface.rpy_deg])
    shift = np.random.default_rng([7, seed]).uniform(-1.0, 1.0, 6) * widths
    return Pose.of_values(np.round(own + shift, 6))


def region_about(pose: Pose) -> Region:
    """All that the surface may have been moved by."""
    widths = [SHIFT] * 3 + [TURN_DEG] * 3
    ends = zip(AXES, pose.values.tolist(), widths, strict=True)
    return Region.around(pose, {name: (v - w, v + w) for name, v, w in ends})
