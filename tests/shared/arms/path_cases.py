"""Paths and trajectories that several tests look at, made once."""

from functools import cache

import asked

from coverable import Task, check, coverage_path, load_case, load_robot, plane, sphere

FEASIBLE = ("4a", "4b", "4c", "4e", "5a", "5b", "5c", "5d", "5e", "5f")
COARSE = {f"{name}, coarse": name for name in ("4a", "4c", "5c")}
"""Paper cases with few cells, whose trajectories take a tenth of the time."""
BEST = dict.fromkeys((*FEASIBLE, *COARSE), "shortest")
BEST |= {"5c": "spiral", "5c, coarse": "spiral", "5a": "columns"}
"""An order for each case; `test_paths` tries all four for some."""
PATCHES = {
    "ur5": plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside"),
    "panda": sphere(0.25, (10, 45), (150, 210), position=(0.65, 0, 0.1), side="outside"),
}
SPEED = 0.15  # [m/s]


@cache
def verdict_of(name):
    if name in COARSE:
        return check(*load_case(f"paper/{COARSE[name]}", ["surface.cells=[4, 4]"]).build())
    if name not in PATCHES:
        return asked.verdict_of(f"paper {name}")
    return check(load_robot(name), PATCHES[name].cells(3, 4), Task(standoff=0.02, cone_deg=25))


@cache
def path_of(name, order=None):
    return coverage_path(verdict_of(name), order or BEST.get(name, "rows"))
