"""Pictures of placements: the arm, the surface at its best and feasible poses, dots at the others.

from coverable import view_placements
view_placements(placements).save_html("placements.html")
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from coverable.arrays import Array
from coverable.errors import ArgumentError, at_least, counted
from feasibility.cases.case import Setup
from feasibility.placement.region import Pose, moved_cells
from feasibility.placement.trials import Trial
from feasibility.search_settings import Progress, Search
from feasibility.verdict import Evidence
from feasibility.viewer import robot_visuals
from feasibility.viewer.playback import Playback, motion_of
from feasibility.viewer.pose_outlines import (
    Class,
    Tried,
    best_layers,
    class_layers,
    class_of_row,
    class_of_trial,
    outline,
    placed,
    station_layers,
)
from feasibility.viewer.stage import framing, joint_points
from feasibility.viewer.verdict_scene import Layer, cells_layers, hidden
from feasibility.viewer.viewer import View, compose, titled
from robots.robot import Robot

if TYPE_CHECKING:
    from feasibility.placement.placements import Placements
    from feasibility.placement.stations import StationPlan
    from feasibility.studies.run import StudyTask
    from feasibility.studies.store import Row


LOOKED = 24  # configurations of a motion that have to be in the picture
NEARER = 0.9  # [1] of the distance from which a ball around everything would fill the picture


def view_placements(
    placements: Placements,
    search: Search | None = None,
    case: str | None = None,
    plan: StationPlan | None = None,
    *,
    progress: Progress | None = None,
    play: bool = True,
    at: float = 0.0,
) -> View:
    """The best placement with its motion, outlines of the feasible ones, a dot for each other one.

    Args:
        placements: what a search for placements found.
        search: its settings; the best placement is decided once more, for its motion.
        case: name of the case, for the title.
        plan: stations to draw too, each with its cells.
        progress: of that search, see `feasibility.check`.
        play: start the motion when the page opens.
        at: share of the motion, 0 to 1, at which the arm waits when `play` is False.
    """
    setup = Setup(placements.robot, placements.cells, placements.task, search or Search())
    trials = _best_first(placements)
    tried = [
        Tried(trial.pose, class_of_trial(trial), trial.covers[0] if len(trial.covers) else None)
        for trial in trials
    ]
    answer = f"{placements.answer} ({placements.evidence})"
    feasible = sum(trial.feasible for trial in trials)
    title = titled(f"{answer}, {feasible} of {len(trials)} placements feasible", case)
    text, stations = _found_text(placements, trials), []
    if plan is not None:
        layers = station_layers(placements.cells, plan)
        stations = list(zip(layers, [trial.pose for trial in plan.trials], strict=True))
        left_out = len(plan.cells(-1))
        text += f"; {len(layers)} station{' covers ' if len(layers) == 1 else 's cover '}"
        text += f"{len(placements.cells) - left_out} of {counted(len(placements.cells), 'cell')}"
    return _view(setup, tried, title, text, stations, progress, play=play, at=at)


def view_study(
    tasks: Sequence[StudyTask],
    rows: Sequence[Row],
    name: str | None = None,
    *,
    progress: Progress | None = None,
    play: bool = True,
    at: float = 0.0,
) -> View:
    """The poses of a study as outlines, for the arm and the task of its best row.

    Rows that differ from the best one in more than the pose are not drawn: another arm, cone or
    surface makes another picture.

    Args:
        tasks: of the study.
        rows: their outcomes, in the same order.
        name: of the study, for the title.
        progress, play, at: as in `view_placements`.

    Raises:
        ArgumentError: there are no rows, or not one for each task.
    """
    from feasibility.studies.built_cases import arm_of, case_of, cut_of
    from feasibility.studies.stored import cells_of
    from feasibility.studies.study_outcome import merit

    if len(rows) == 0 or len(tasks) != len(rows):
        raise ArgumentError(f"expected a row for each task, got {len(rows)} for {len(tasks)} tasks")
    best = min(range(len(rows)), key=lambda k: merit(rows[k].result))
    drawn = sorted(same_frame(tasks, best), key=lambda k: merit(rows[k].result))
    case = case_of(dict(tasks[best].tables))
    setup = Setup(arm_of(case), cut_of(case), case.built_task(), case.search)
    tried = []
    for k in drawn:
        bits = (rows[k].result.get("components") or [None])[0]
        cover = None if bits is None else cells_of(bits, int(rows[k].result["cells"]))
        tried.append(Tried(pose_of(tasks[k].tables), class_of_row(rows[k]), cover))
    text = f"{len(rows)} cases, cone {setup.task.cone_deg:g} deg"
    if len(drawn) < len(rows):
        text = f"{len(drawn)} of {text}"
        text += "; those that differ from the best one in more than the pose are not drawn"
    feasible = sum(row.result.get("verdict") == "feasible" for row in rows)
    title = titled(f"{feasible} of {len(rows)} cases feasible", name)
    return _view(setup, tried, title, text, [], progress, play=play, at=at)


def pose_of(tables: Any) -> Pose:
    """The pose of the surface in the tables of a case."""
    surface = tables["surface"]
    return Pose.of_values([*surface.get("position", (0, 0, 0)), *surface.get("rpy_deg", (0, 0, 0))])


def same_frame(tasks: Sequence[StudyTask], row: int) -> list[int]:
    """The tasks that differ from one of them in the surface's pose at most."""

    def rest(tables: Any) -> Any:
        surface = {k: v for k, v in tables["surface"].items() if k not in ("position", "rpy_deg")}
        return {**tables, "surface": surface}

    wanted = rest(tasks[row].tables)
    return [k for k, task in enumerate(tasks) if rest(task.tables) == wanted]


def _best_first(placements: Placements) -> list[Trial]:
    """All trials; those found feasible come first, by their margin."""
    found = list(placements.found)
    return found + [trial for trial in placements.trials if not any(trial is f for f in found)]


def _found_text(placements: Placements, trials: Sequence[Trial]) -> str:
    """How many placements were tried, and the outcome of the best one."""
    if placements.evidence is Evidence.PROOF:
        return "a part of the surface is out of reach everywhere in the region"
    if not trials:
        return "no placement was tried; the surface is drawn at its pose in the case"
    text = f"{len(trials)} placements tried"
    beyond = int(placements.statistics.get("bound", 0))
    if beyond:
        text += f", {beyond} more discarded as out of reach and not drawn"
    if placements.found:
        best = at_least(1e3 * placements.found[0].margin, 3)
        return f"{text}; the best leaves a margin of {best} mm"
    return f"{text}; the best covers {100.0 * placements.share:.1f} % of the area"


def _view(
    setup: Setup,
    tried: Sequence[Tried],
    title: str,
    text: str,
    stations: Sequence[tuple[Layer, Pose]],
    progress: Progress | None,
    **playing: Any,
) -> View:
    """One picture of poses tried, the best one first among them; `playing` as in `compose`."""
    from feasibility.checking import check

    cells, motion, parts = setup.cells, None, cells_layers(setup.cells)
    if tried:
        cells = moved_cells(setup.cells, tried[0].pose)
        if tried[0].kind is Class.FEASIBLE:
            verdict = check(setup.robot, cells, setup.task, setup.search, progress=progress)
            if verdict.feasible:  # else this search ran out of time
                motion = motion_of(verdict)
        parts = best_layers(cells, tried[0], motion)
    if stations:  # the best single placement would lie among them
        parts = [hidden(layer) for layer in parts]
    lines = outline(setup.cells)
    drawn = compose(
        setup.robot, cells, title, f"{setup.robot.name}: {text}",
        [*parts, *(layer for layer, _ in stations), *class_layers(lines, tried)], motion,
        resting=robot_visuals.home(setup.robot), task=setup.task, **playing,
    )  # fmt: skip
    points = [placed(lines, one.pose) for one in tried if one.kind is Class.FEASIBLE]
    full_size = [pose for _, pose in stations] or [one.pose for one in tried[:1]]
    points += [placed(lines, pose) for pose in full_size]
    points.append(_joints(setup.robot, motion))
    every = np.concatenate([part.reshape(-1, 3) for part in points])
    toward = np.array(drawn.camera.eye) - np.array(drawn.camera.target)
    camera = framing(every, toward / np.linalg.norm(toward), NEARER)
    return replace(drawn, camera=camera)


def _joints(robot: Robot, motion: Playback | None) -> Array:
    """(k, 3) m: the base and the joints of the arm as it moves, or at rest."""
    walk = robot_visuals.home(robot)[None]
    if motion is not None:
        walk = motion.at(np.linspace(0.0, motion.seconds[-1], LOOKED))
    return np.concatenate([np.zeros((1, 3)), joint_points(robot, walk)])
