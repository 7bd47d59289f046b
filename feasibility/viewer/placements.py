"""Pictures of placements: the arm, and the surface wherever it was tried, by what is covered there.

from feasibility.placement_view import view_placements
view_placements(placements).save_html("placements.html")
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from coverable_errors import ArgumentError
from feasibility.placement import Pose, Stage, Trial, moved_cells
from feasibility.search import Progress, Search
from feasibility.viewer import robot as robot_visuals
from feasibility.viewer.html_page import Camera
from feasibility.viewer.outline import outline, placed
from feasibility.viewer.playback import Motion, motion_of
from feasibility.viewer.pose_layers import (
    HIDDEN,
    Class,
    Tried,
    best_layers,
    class_layers,
    class_of_row,
    class_of_trial,
    drawn_size,
    hidden,
    station_layers,
)
from feasibility.viewer.scene import Layer, cells_layers, counted
from feasibility.viewer.viewer import FRAMED, View, compose
from robots import Robot
from surfaces import Cells

if TYPE_CHECKING:
    from feasibility.placement import Placements, StationPlan
    from feasibility.studies import Row, StudyTask
    from feasibility.task import Task

Array = NDArray[np.float64]

LOOKED = 24  # configurations of a motion that have to be in the picture
NEARER = 0.9  # [1] of the distance from which a ball around everything would fill the picture


@dataclass(frozen=True, eq=False, slots=True)
class Question:
    """What was asked at every pose."""

    robot: Robot
    cells: Cells
    task: Task
    search: Search


@dataclass(frozen=True, eq=False, slots=True)
class Playing:
    """How the motion over the best pose is looked for, and played."""

    progress: Progress | None
    play: bool
    at: float


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
    """Every placement tried as an outline of the surface, and the best one with its motion.

    Args:
        placements: what a search for placements found.
        search: its settings; the best placement is asked about once more, for its motion.
        case: name of the case, for the title.
        plan: stations to draw too, each with its cells.
        progress: of that question, see `feasibility.check`.
        play: start the motion when the page opens.
        at: share of the motion, 0 to 1, at which the arm waits when `play` is False.
    """
    asked = Question(placements.robot, placements.cells, placements.task, search or Search())
    trials = _best_first(placements)
    tried = [
        Tried(trial.pose, class_of_trial(trial), trial.covers[0] if len(trial.covers) else None)
        for trial in trials
    ]
    title = f"{case}: " if case else ""
    title += f"placements, {placements.answer} ({placements.evidence})"
    text, stations = _said(placements, trials), []
    if plan is not None:
        layers = station_layers(placements.cells, plan)
        stations = list(zip(layers, [trial.pose for trial in plan.trials], strict=True))
        left_out = len(plan.stations.left_out)
        text += f"; {len(layers)} station{' covers ' if len(layers) == 1 else 's cover '}"
        text += f"{len(placements.cells) - left_out} of {counted(len(placements.cells))}"
    return _view(asked, tried, title, text, stations, Playing(progress, play, at))


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

    Rows that differ from the best one in more than the pose are not drawn: another arm, another
    cone or another surface makes another picture.

    Args:
        tasks: of the study.
        rows: what came of them, in the same order.
        name: of the study, for the title.
        progress: of the question about the best row's motion, see `feasibility.check`.
        play: start the motion when the page opens.
        at: share of the motion, 0 to 1, at which the arm waits when `play` is False.

    Raises:
        ArgumentError: there are no rows, or not one for each task.
    """
    from feasibility.studies import arm_of, case_of, cells_of, cut_of, merit

    if len(rows) == 0 or len(tasks) != len(rows):
        raise ArgumentError(f"expected a row for each task, got {len(rows)} for {len(tasks)} tasks")
    best = min(range(len(rows)), key=lambda k: merit(rows[k].result))
    drawn = sorted(same_frame(tasks, best), key=lambda k: merit(rows[k].result))
    case = case_of(dict(tasks[best].tables))
    asked = Question(arm_of(case), cut_of(case), case.task, case.search)
    tried = []
    for k in drawn:
        bits = (rows[k].result.get("components") or [None])[0]
        cover = None if bits is None else cells_of(bits, int(rows[k].result["cells"]))
        tried.append(Tried(pose_of(tasks[k].tables), class_of_row(rows[k]), cover))
    whole = len(drawn) == len(rows)
    text = f"{len(rows)} cases" if whole else f"{len(drawn)} of {len(rows)} cases"
    text += f", cone {asked.task.cone_deg:g} deg"
    if not whole:
        text += "; those that differ from the best one in more than the pose are not drawn"
    title = (f"{name}: " if name else "") + "poses of the surface"
    return _view(asked, tried, title, text, [], Playing(progress, play, at))


def pose_of(tables: Any) -> Pose:
    """Where the surface stands in the tables of a case."""
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


def _said(placements: Placements, trials: Sequence[Trial]) -> str:
    """How many placements were tried, and what the best one gives."""
    if not trials:
        return "no placement was tried; the surface is drawn where it stands in the case"
    if all(trial.stage is Stage.BOUND for trial in trials):
        return "wherever the surface stands in the region, a part is out of reach"
    text = f"{len(trials)} placements tried"
    beyond = int(placements.statistics.get("bound", 0))
    if beyond:
        text += f", {beyond} more discarded as out of reach and not drawn"
    if placements.found:
        return f"{text}; the best leaves a margin of {placements.found[0].margin:.3f}"
    return f"{text}; the best covers {100.0 * placements.share:.1f} % of the area"


def _view(
    asked: Question,
    tried: Sequence[Tried],
    title: str,
    text: str,
    stations: Sequence[tuple[Layer, Pose]],
    playing: Playing,
) -> View:
    """One picture of poses tried, the best one first among them."""
    cells, motion, parts = asked.cells, None, cells_layers(asked.cells)
    if tried:
        cells = moved_cells(asked.cells, tried[0].pose)
        if tried[0].kind is Class.FEASIBLE:
            motion = _motion(asked, cells, playing.progress)
        parts = best_layers(cells, tried[0], motion)
    if stations:  # they are what is asked for; the best single one would lie among them
        parts = [hidden(layer) for layer in parts]
    lines, size = outline(asked.cells), drawn_size(tried)
    small = lines
    if len(lines):
        middle = (lines.min(axis=(0, 1)) + lines.max(axis=(0, 1))) / 2.0
        small = middle + size * (lines - middle)
    if size < 1.0:
        text += f". Outlines are drawn at {100.0 * size:.0f} % of their size"
    drawn = compose(
        asked.robot, cells, title, f"{asked.robot.name}: {text}",
        [*parts, *(layer for layer, _ in stations), *class_layers(small, tried)], motion,
        resting=robot_visuals.home(asked.robot), play=playing.play, at=playing.at,
    )  # fmt: skip
    points = [placed(small, one.pose) for one in tried if one.kind not in HIDDEN]
    whole = [pose for _, pose in stations] or [one.pose for one in tried[:1]]
    points += [placed(lines, pose) for pose in whole]
    every = np.concatenate([part.reshape(-1, 3) for part in points] or [np.empty((0, 3))])
    return replace(drawn, camera=_camera(drawn.camera, asked.robot, motion, every))


def _motion(asked: Question, cells: Cells, progress: Progress | None) -> Motion | None:
    """The covering motion over the best placement; None if the search ran out of time now."""
    from feasibility.checking import check

    verdict = check(asked.robot, cells, asked.task, asked.search, progress=progress)
    return motion_of(verdict) if verdict.feasible else None


def _camera(camera: Camera, robot: Robot, motion: Motion | None, points: Array) -> Camera:
    """The same direction, from where the arm, as it moves, and points (k, 3) m can be seen."""
    walk = robot_visuals.home(robot)[None]
    if motion is not None:
        walk = motion.at(np.linspace(0.0, motion.seconds[-1], LOOKED))
    joints = [np.zeros((1, 3))]
    place = np.broadcast_to(np.eye(4), (len(walk), 4, 4))
    for step in robot_visuals.joint_placements(robot, walk).transpose(1, 0, 2, 3):
        place = place @ step
        joints.append(place[:, :3, 3])
    every = np.concatenate([*joints, points])
    target = (every.min(axis=0) + every.max(axis=0)) / 2.0
    radius = max(float(np.linalg.norm(every - target, axis=1).max()), 0.1)
    toward = np.array(camera.eye) - np.array(camera.target)
    eye = target + NEARER * radius / np.sin(FRAMED) * toward / np.linalg.norm(toward)
    return Camera(tuple(target.tolist()), tuple(eye.tolist()), camera.zoom)
