"""The twelve published cases (Tables I to III), and what is said of each."""

from __future__ import annotations

from typing import NamedTuple

from feasibility import Task
from robots import Robot, load_robot
from surfaces import Cells, cylinder, hyperboloid, sphere


class PaperCase(NamedTuple):
    surface: str
    position: tuple[float, float, float]
    cone_deg: float
    limits: str
    connected: bool
    """What the paper says of graph G."""

    def robot(self) -> Robot:
        return load_robot("puma560", limits=self.limits)

    def cells(self) -> Cells:
        if self.surface == "sphere":
            patch = sphere(1.0, (10, 90), (10, 180), position=self.position)
        elif self.surface == "cylinder":
            patch = cylinder(0.5, (-60, 60), (0.0, 0.9), position=self.position)
        else:
            patch = hyperboloid(0.5, 0.5, (130, 220), (0.0, 0.5), position=self.position)
        return patch.cells(9, 10)

    def task(self) -> Task:
        return Task(standoff=0.005, cone_deg=self.cone_deg)


PAPER_CASES = {
    "4a": PaperCase("sphere", (0, 0, 0), 45, "set-1", True),
    "4b": PaperCase("sphere", (0, 0, 0), 45, "set-2", False),
    "4c": PaperCase("cylinder", (0, 0, 0), 45, "set-1", True),
    "4d": PaperCase("cylinder", (0, 0, 0), 45, "set-3", False),
    "4e": PaperCase("hyperboloid", (0, 0, 0), 45, "set-1", True),
    "4f": PaperCase("hyperboloid", (0, 0, 0), 45, "set-4", False),
    "5a": PaperCase("sphere", (0, 0, 0), 5, "set-1", False),
    "5b": PaperCase("sphere", (0.005, 0, 0), 10, "set-1", False),
    "5c": PaperCase("cylinder", (0, 0.055, 0), 5, "set-1", False),
    "5d": PaperCase("cylinder", (0, 0.055, 0), 10, "set-1", True),
    "5e": PaperCase("hyperboloid", (1.095, 0, 0), 10, "set-1", False),
    "5f": PaperCase("hyperboloid", (1.15, 0, 0), 20, "set-1", False),
}
