"""What discarding hopeless placements early saves, and what it costs."""

from __future__ import annotations

import time

from feasibility.cases import load_case
from feasibility.placement import Pose, Region, Stage, place
from feasibility.placement.evaluator import LocalEvaluator
from feasibility.placement.reach_bound import Reach

REGIONS = {
    "within 0.3 m, 40 deg": {
        "x": (-0.3, 0.3), "y": (-0.3, 0.3), "z": (-0.3, 0.3),
        "roll_deg": (-40, 40), "pitch_deg": (-40, 40), "yaw_deg": (-40, 40),
    },
    "any rotation": {"roll_deg": (-180, 180), "pitch_deg": (-90, 90), "yaw_deg": (-180, 180)},
    "the whole cell": {
        "x": (-1.5, 1.5), "y": (-1.5, 1.5), "z": (-0.5, 0.5),
        "roll_deg": (-90, 90), "pitch_deg": (-90, 90), "yaw_deg": (-180, 180),
    },
    "3 m away": {"x": (2.7, 3.3), "y": (-0.3, 0.3), "yaw_deg": (-40, 40)},
}  # fmt: skip
CASES = ("paper/4a", "paper/4c")
COUNT = 128


def rows(count: int = COUNT) -> tuple[str, list[dict[str, object]]]:
    """One row for each case and region: the same poses with and without early rejection."""
    table = []
    for name in CASES:
        setup = load_case(name).build()
        local = LocalEvaluator(*setup)
        own = Pose.of_surface(setup.cells.surface)
        local.try_all([own], True)
        for title, ranges in REGIONS.items():
            region = Region.around(own, ranges)
            began = time.perf_counter()
            answer = place(*setup[:3], region, setup.search, count=count)
            whole_s = time.perf_counter() - began
            table.append({"case": name, "region": title, **_sweep(local, region, count),
                          "answer of place": str(answer.answer), "place s": whole_s,
                          "margin": answer.best.margin if answer.best else 0.0})  # fmt: skip
    return f"Placements: {count} poses of a region, with and without early rejection.", table


def _sweep(placer: LocalEvaluator, region: Region, count: int) -> dict[str, object]:
    """The same poses searched all, and with bounds and probes first; s of processor time."""
    poses = [Pose.of_values(row) for row in region.samples(count, 0)[:count]]
    began = time.process_time()
    Reach.of(placer.robot, placer.cells, placer.task).beyond(region)
    early = [placer.try_at(pose) for pose in poses]
    between = time.process_time()
    every = [placer.try_at(pose, early=False) for pose in poses]
    early_s, every_s = between - began, time.process_time() - between
    lost = [
        one.stage is not Stage.SEARCH and other.complete
        for one, other in zip(early, every, strict=True)
    ]
    stages = [trial.stage for trial in early]
    return {
        "hopeless": f"{sum(not trial.complete for trial in every)} of {count}",
        "bound": stages.count(Stage.BOUND),
        "probe": stages.count(Stage.PROBE),
        "early CPU s": early_s,
        "all CPU s": every_s,
        "ratio (target 0.5)": early_s / every_s,
        "feasible ones lost": sum(lost),
    }
