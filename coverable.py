"""Can this arm move its tool continuously over this whole surface?

The front door: everything that a user needs, by name. What a name needs is imported when the name
is first used, so `import coverable` costs nothing.

>>> from coverable import Task, check, load_robot, sphere
>>> puma = load_robot("puma560", limits="set-1")
>>> dome = sphere(radius=1.0, polar_deg=(10, 90), azimuth_deg=(10, 180), side="inside")
>>> verdict = check(puma, dome.cells(9, 10), Task(standoff=0.005, cone_deg=45))
>>> verdict.feasible, verdict.n_covered, verdict.n_edges
(True, 90, 305)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from coverable_errors import ArgumentError, CoverableError
    from feasibility import (
        Answer,
        Cause,
        CauseKind,
        Evidence,
        Search,
        Task,
        Verdict,
        Verification,
        check,
        greedy_check,
        verify,
    )
    from feasibility.cases import Case, CaseError, builtin_cases, load_case
    from feasibility.certification import replay
    from feasibility.collisions import Collision, Obstacle, ToolShape
    from feasibility.division import Division, divide
    from feasibility.live import Live, live
    from feasibility.paper import LiteralSearch, starts
    from feasibility.paths import CoveragePath, PathError, coverage_path
    from feasibility.paths import coverage_path as path
    from feasibility.placement import (
        Placements,
        Pose,
        Region,
        evaluator_here,
        place,
        placement_map,
        station_plan,
    )
    from feasibility.programs import ProgramSettings, save_program
    from feasibility.reports.comparison import as_text as comparison_text
    from feasibility.reports.comparison import chart as comparison_chart
    from feasibility.reports.division import as_text as division_text
    from feasibility.reports.explanation import as_text as explanation_text
    from feasibility.reports.path import as_text as path_text
    from feasibility.reports.placement import as_text as placement_text
    from feasibility.reports.placement import settings_of
    from feasibility.reports.study import as_text as study_text
    from feasibility.results import (
        load_motion,
        load_result,
        load_trajectory,
        save_result,
        save_trajectory,
    )
    from feasibility.runs import PassRuns, PlannedPasses, pass_runs, plan_best_passes, plan_passes
    from feasibility.sensitivity import Explanation, explain
    from feasibility.studies import (
        Comparison,
        Store,
        Study,
        compare,
        load_study,
        open_workers,
        read_study,
        run_tasks,
    )
    from feasibility.timing import Trajectory, motion_limits, trajectory
    from feasibility.treated import TreatedArea, treated_words
    from feasibility.viewer import (
        Plot,
        View,
        plot_causes,
        plot_graph,
        plot_map,
        plot_sides,
        plot_transition,
        plot_view,
        plot_views,
        show,
        unrolled_edges,
        view,
        view_division,
        view_path,
        view_placements,
        view_study,
    )
    from feasibility.viewer.passes import view_passes
    from robots import Axis, Robot, RobotError, as_yourdfpy, list_robots, load_robot
    from surfaces import (
        Cells,
        MeshSurface,
        Patch,
        Piecewise,
        Surface,
        SurfaceError,
        bspline,
        cone,
        cut_box,
        cut_plane,
        cylinder,
        ellipsoid,
        faces_within_cone,
        grid,
        hyperboloid,
        mesh,
        parallel_passes,
        parametric,
        pass_toolpath,
        piecewise,
        plane,
        poses,
        read_grid,
        read_net,
        read_poses,
        revolution,
        sphere,
        step,
        step_faces,
        take_faces,
        torus,
    )

    __version__: str

# fmt: off
__all__ = [
    "Answer", "ArgumentError", "Axis", "Case", "CaseError", "Cause", "CauseKind", "Cells",
    "Collision", "Comparison", "CoverableError", "CoveragePath", "Division",
    "Evidence", "Explanation",
    "LiteralSearch", "Live", "MeshSurface", "Obstacle", "PassRuns",
    "Patch", "PathError", "Piecewise", "Placements", "PlannedPasses", "Plot", "Pose",
    "ProgramSettings",
    "Region", "Robot", "RobotError", "Search", "Store", "Study", "Surface", "SurfaceError",
    "Task", "ToolShape", "Trajectory", "TreatedArea", "Verdict", "Verification", "View",
    "__version__", "as_yourdfpy", "bspline", "builtin_cases", "check", "compare",
    "comparison_chart", "comparison_text", "cone", "coverage_path", "cut_box", "cut_plane",
    "cylinder", "divide", "division_text", "ellipsoid", "evaluator_here", "explain",
    "explanation_text",
    "faces_within_cone", "greedy_check", "grid", "hyperboloid", "list_robots", "live",
    "load_case", "load_motion", "load_result", "load_robot", "load_study", "load_trajectory",
    "mesh", "motion_limits", "open_workers", "parallel_passes", "parametric", "pass_runs",
    "pass_toolpath", "path", "path_text", "piecewise", "place",
    "placement_map", "placement_text", "plan_best_passes", "plan_passes", "plane",
    "plot_causes", "plot_graph", "plot_map", "plot_sides", "plot_transition", "plot_view",
    "plot_views", "poses", "read_grid", "read_net", "read_poses", "read_study", "replay",
    "revolution", "run_tasks", "save_program", "save_result", "save_trajectory",
    "settings_of", "show", "sphere", "starts", "station_plan", "step", "step_faces",
    "study_text", "take_faces", "torus", "trajectory", "treated_words", "unrolled_edges",
    "verify", "view", "view_division", "view_passes", "view_path", "view_placements",
    "view_study",
]
# fmt: on

_ROOMS = (
    "robots",
    "surfaces",
    "feasibility",
    "feasibility.collisions",
    "feasibility.cases",
    "feasibility.certification",
    "feasibility.paper",
    "feasibility.paths",
    "feasibility.timing",
    "feasibility.programs",
    "feasibility.division",
    "feasibility.treated",
    "feasibility.runs",
    "feasibility.sensitivity",
    "feasibility.results",
    "feasibility.studies",
    "feasibility.placement",
    "feasibility.viewer",
    "feasibility.viewer.passes",
    "feasibility.live",
)
_ELSEWHERE = {  # name -> module, name there: of no room, or by another name
    "ArgumentError": ("coverable_errors", "ArgumentError"),
    "CoverableError": ("coverable_errors", "CoverableError"),
    "comparison_chart": ("feasibility.reports.comparison", "chart"),
    "comparison_text": ("feasibility.reports.comparison", "as_text"),
    "division_text": ("feasibility.reports.division", "as_text"),
    "explanation_text": ("feasibility.reports.explanation", "as_text"),
    "path": ("feasibility.paths", "coverage_path"),
    "path_text": ("feasibility.reports.path", "as_text"),
    "placement_text": ("feasibility.reports.placement", "as_text"),
    "settings_of": ("feasibility.reports.placement", "settings_of"),
    "study_text": ("feasibility.reports.study", "as_text"),
}


def __getattr__(name: str) -> Any:
    """Import a public name from its room when it is first used."""
    if name == "__version__":
        return import_module("feasibility.version").version()
    if name not in __all__:
        raise AttributeError(f"module 'coverable' has no attribute {name!r}")
    if name in _ELSEWHERE:
        module, there = _ELSEWHERE[name]
        value = getattr(import_module(module), there)
    else:
        room = next(r for r in map(import_module, _ROOMS) if name in r.__all__)
        value = getattr(room, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names."""
    return list(__all__)
