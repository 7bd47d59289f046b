"""Small questions that are answered at once, one for each kind of answer."""

from __future__ import annotations

from functools import cache

from feasibility import check
from feasibility.cases import Case

TEXTS = {
    # ur5 above a small plate: feasible; keys can follow
    "plate": """
robot.name = "ur5"
surface.kind = "plane"
surface.u = [0.4, 0.6]
surface.v = [-0.1, 0.1]
surface.cells = [3, 4]
surface.position = [0, 0, 0.3]
surface.side = "outside"
task.standoff = 0.02
task.cone_deg = 30
""",
    # a plate that begins within reach and ends outside: proved infeasible
    "long plate": """
        robot = { name = "ur5" }
        surface.kind = "plane"
        surface.u = [0.4, 2.4]
        surface.v = [-0.1, 0.1]
        surface.cells = [4, 2]
        surface.position = [0, 0, 0.3]
        surface.side = "outside"
        task = { standoff = 0.02, cone_deg = 30, tolerance = 0.002 }
        search = { seed = 5 }
    """,
    "greedy dome": """
        robot = { name = "puma560", limits = "set-1" }
        surface.kind = "sphere"
        surface.radius = 1
        surface.u_deg = [40, 60]
        surface.v_deg = [60, 90]
        surface.cells = [2, 3]
        task = { standoff = 0.005, cone_deg = 45 }
        search = { method = "greedy", step_deg = 0.05 }
    """,
}


@cache
def small_case(name):
    """The case of that name."""
    return Case.from_toml(TEXTS[name], name=name)


@cache
def small_verdict(name):
    """Its verdict."""
    return check(*small_case(name).build())
