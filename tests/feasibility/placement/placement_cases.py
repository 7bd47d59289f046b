"""Feasible cases for three arms, and shifts that make them infeasible."""

from __future__ import annotations

import numpy as np

from feasibility import Answer, Evidence, check
from feasibility.cases import Case
from feasibility.placement import AXES, Pose, Region, Trial, place
from feasibility.reports.placement import settings_of

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

MOVED = [
    ("puma560 pipe", 2),
    ("puma560 pipe", 21),
    ("puma560 dome", 12),
    ("puma560 dome", 21),
    ("ur5 plate", 3),
    ("ur5 plate", 9),
    ("ur5 pipe", 3),
    ("ur5 pipe", 8),
    ("ur5 pipe", 15),
    ("panda plate", 3),
    ("panda plate", 10),
    ("panda dome", 7),
    ("panda dome", 9),
]
"""Cases, and seeds of shifts."""
DEAR = [
    ("puma560 pipe", 2),
    ("puma560 dome", 12),
    ("ur5 pipe", 3),
    ("ur5 pipe", 15),
    ("panda plate", 10),
    ("panda dome", 7),
    ("panda dome", 9),
    ("puma560 dome", 21),
]
"""Those that take most of the time: `make campaign NAME=moved_surfaces` tries them too."""


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


def assert_put_back(name: str, seed: int) -> None:
    """Infeasible where it was moved to; in the region around it `place` finds a feasible place."""
    case = placement_case(name)
    away = moved_away(case, seed)
    moved = case.with_overrides(settings_of(away)).build()
    assert check(*moved).answer is Answer.INFEASIBLE
    region = region_about(away)
    placements = place(*moved[:3], region, moved.search, count=32, around=2, keep=2)
    assert placements.answer is Answer.FEASIBLE
    assert placements.evidence is Evidence.WITNESS
    for trial in placements.found:
        assert region.holds(trial.pose)
        assert check(*case.with_overrides(settings_of(trial.pose)).build()).feasible
        assert trial.complete
        assert trial.share == 1.0
        assert trial.margins is not None
        assert 0.0 <= trial.margin == min(vars_of(trial)) <= 1.0
    assert placements.best is placements.found[0]
    margins = [trial.margin for trial in placements.found]
    assert margins == sorted(margins, reverse=True)


def vars_of(trial: Trial) -> tuple[float, ...]:
    """The three shares."""
    assert trial.margins is not None
    return trial.margins.limits, trial.margins.cone, trial.margins.reach
