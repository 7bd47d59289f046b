"""Programs as files: the comment at the head, and when the tool works.

It does not where it is lifted, nor over holes. Times are those of the trajectory, whose samples the
replay has judged.
"""

from __future__ import annotations

import os
import re
from collections import defaultdict
from collections.abc import Sequence
from itertools import groupby
from operator import itemgetter, methodcaller
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from coverable.arrays import Array, Ints
from coverable.errors import counted
from feasibility.collisions.words import listed_words
from feasibility.programs.controller_axes import AxisMap, ProgramSettings, check_program
from feasibility.programs.controllers import INFORM, KRL, RAPID, TP, URSCRIPT, Language, language_of
from feasibility.programs.program_texts import SERVO, Points, inform, krl, rapid, tp, urscript
from feasibility.safe_files import write_whole
from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.version import version
from robots.robot import Robot
from surfaces.passes.pass_stretches import Pass
from surfaces.passes.toolpath import LIFTED, PassPlaces
from surfaces.surface import Surface

OFF = -1
ROUNDING = 1e-6  # [s]
LONGEST_NAME = 24  # characters of a program's name
TEXTS = {URSCRIPT: urscript, RAPID: rapid, KRL: krl, TP: tp, INFORM: inform}
FLANGES = ("tool0", "flange", "ee_link")


def working_places(places: PassPlaces, stretches: Sequence[Pass]) -> Ints:
    """(N,) which stretch of work each place belongs to; -1 where the tool is lifted.

    Where one pass follows on another along the surface the tool goes on working, as it does for the
    treated area; between two parts of one pass there is a hole.
    """
    levels = np.array([each.level for each in stretches])
    lifted = places.stretch == LIFTED
    stretch = np.where(lifted, 0, places.at_work)
    onto = (np.diff(stretch, prepend=stretch[:1]) != 0) & ~lifted
    hole = onto & (levels[stretch] == np.roll(levels[stretch], 1))
    begins = hole | (np.diff(lifted.astype(np.int64), prepend=1) < 0)
    return np.where(lifted, OFF, np.cumsum(begins) - 1)


def working_times(run: Trajectory, work: Ints | None = None) -> list[tuple[float, float]]:
    """s, beginning and end of each stretch in which the tool works, in order.

    Args:
        run: a trajectory; before the first cell and behind the last one it does not work.
        work: (N,) which stretch of work each cell belongs to, -1 for none, see `working_places`; by
            default all are one.

    Example:
        >>> still, cells = np.zeros((4, 1)), np.array([-1, 0, 2, 1])
        >>> run = Trajectory(("a",), np.arange(4.0), still, still, still, np.zeros(4), cells)
        >>> working_times(run), working_times(run, np.array([0, 0, -1]))
        ([(1.0, 3.0)], [(1.0, 1.0), (3.0, 3.0)])
    """
    marks = np.flatnonzero(run.cell >= 0)
    own = np.zeros(len(marks), dtype=np.int64) if work is None else work[run.cell[marks]]
    found = []
    pairs = zip(own.tolist(), run.time[marks].tolist(), strict=True)
    for number, group in groupby(pairs, itemgetter(0)):
        times = [time for _, time in group]
        if number != OFF:
            found.append((times[0], times[-1]))
    return found


def save_program(
    path: str | os.PathLike[str],
    robot: Robot,
    run: Trajectory,
    case: str = "case",
    settings: ProgramSettings | None = None,
    surface: Surface | None = None,
    work: Ints | None = None,
) -> Path:
    """Write a timed motion as a program in the language of the file's ending, see `language_of`.

    Args:
        path: of the file; one of TP or INFORM that is too long calls others beside it, NAME_p1,
            NAME_p2.
        robot, run: the arm and its trajectory.
        case: what the question is called, for the comment at the head.
        settings: of the controller, and the lines that switch the tool on and off.
        surface: what is treated, whose frame is stated at the head.
        work: (N,) which stretch of work each cell belongs to, see `working_times`; by default the
            tool works from the first cell to the last.

    Raises:
        FileError: another ending, or a file cannot be written.
        ProgramError: the arm has no program in this language, or the settings make none.
    """
    language, file = language_of(path), Path(path)
    settings = ProgramSettings() if settings is None else settings
    axes = check_program(language, robot, settings)
    start = float(run.time[0])
    time, q = run.time - start, run.q
    if language is URSCRIPT:  # the last point is at the end, or behind it
        time = np.arange(np.ceil(round(run.duration / SERVO, 6)) + 1.0) * SERVO
        q = run.at(start + time)
    times = working_times(run, work) if settings.on else []
    switched = [(begin - start, end - start) for begin, end in times]
    points = _points(axes, robot, time, q, switched, settings)
    name = re.sub(r"\W", "_", file.stem, flags=re.ASCII)
    name = name if name[:1].isalpha() else f"p_{name}"
    comment = head(axes, robot, run, case, surface, switched)
    texts = TEXTS[language](comment, points, name[:LONGEST_NAME])
    for ending, text in texts.items():
        place = file.with_name(f"{file.stem}{ending}{file.suffix}") if ending else file
        write_whole(place, methodcaller("write", text.encode("ascii")))
    return file


def _points(
    axes: AxisMap, robot: Robot, time: Array, q: Array, switched: list[tuple[float, float]],
    settings: ProgramSettings,
) -> Points:  # fmt: skip
    """Numbers as text, and the steps of rounded times, which add up to the last of them.

    The motion is q (m, n) at times (m,) s from 0; on the stretches `switched`, likewise, the tool
    is on.
    """
    digits, time_digits = axes.language.digits, axes.language.time_digits
    ticks = np.round(time * 10**time_digits)
    kept = np.append(True, np.diff(ticks) > 0)  # of two samples at one time, the first
    time, q, ticks = time[kept], q[kept], ticks[kept]
    arm, external = (
        [[f"{value + 0.0:.{digits}f}" for value in row] for row in table.tolist()]
        for table in axes.values(robot, q)
    )
    steps = np.diff(ticks) / 10**time_digits
    speeds = np.abs(np.diff(q[:, list(axes.arm)], axis=0)) / steps[:, None]
    shares = (speeds / robot.max_velocity[list(axes.arm)]).max(axis=1, initial=0.0)
    at = defaultdict[int, list[str]](list)
    for begin, end in switched:
        first = min(int(np.searchsorted(time, begin - ROUNDING)), len(time) - 1)
        last = max(int(np.searchsorted(time, end + ROUNDING, side="right")) - 1, first)
        at[first].append(settings.on)
        at[last].append(settings.off)
    return Points(
        arm, external, [f"{step:.{time_digits}f}" for step in steps.tolist()], shares.tolist(),
        float(ticks[-1]) / 10**time_digits, at,
    )  # fmt: skip


def frame_words(language: Language, frame: Array) -> str:
    """A frame (4, 4) m as a controller's display or language has it.

    Example:
        >>> frame = np.eye(4)
        >>> frame[:3, 3] = 0.1, 0.0, -0.25
        >>> frame_words(KRL, frame)
        '{X 100, Y 0, Z -250, A 0, B 0, C 0}'
    """
    turn = Rotation.from_matrix(frame[:3, :3])
    metres, mm = (_numbers(scale * frame[:3, 3]) for scale in (1.0, 1e3))
    fixed = _numbers(turn.as_euler("xyz", degrees=True))  # about x, y and z as they stand
    if language is URSCRIPT:
        return f"p[{', '.join([*metres, *_numbers(turn.as_rotvec())])}]"
    if language is RAPID:
        quaternion = _numbers(turn.as_quat(canonical=True, scalar_first=True))
        return f"[[{','.join(mm)}],[{','.join(quaternion)}]]"
    if language is KRL:
        return "{" + _named("X Y Z A B C", [*mm, *reversed(fixed)], ", ") + "}"
    return f"{_named(language.frame, [*mm, *fixed], ' ')} (mm, deg)"


def head(
    axes: AxisMap,
    robot: Robot,
    run: Trajectory,
    case: str,
    surface: Surface | None,
    switched: Sequence[tuple[float, float]],
) -> list[str]:
    """The comment, in lines of plain ASCII.

    The frame of the surface is stated; on the stretches `switched` (s) the tool is on.
    """
    flange, tool = _tool(robot)
    lines = [
        f"{axes.language.name} program of a coverage motion, written by coverable {version()}",
        f"case: {case:.200}; robot: {robot.name:.80}; {run.duration:.3f} s",
        f"{listed_words(run.collisions)}, and dynamics are not checked",
        f"tool: {frame_words(axes.language, tool)} from {flange}",
    ]
    if surface is not None:
        link, part = _part(robot, surface)
        lines.append(f"part: {frame_words(axes.language, part)} from {link}")
    lines += axes.words(robot)
    if switched:
        stretches = counted(len(switched), "stretch", "stretches")
        lines.append(f"The tool is on along {stretches}; how exactly is the controller's affair.")
    lines += [
        "Angles are those of the URDF: compare a few poses with the controller's display first.",
        "No controller has run a program of this kind yet: it follows the language's description.",
        "The move to the first point is not checked. Run it dry, at reduced speed, before use.",
    ]
    return ["".join(c if " " <= c <= "~" else "?" for c in line) for line in lines]


def _tool(robot: Robot) -> tuple[str, Array]:
    """The flange, or what is nearest to one, and the tool centre point (4, 4) m in its frame."""
    model = robot.model
    last = model.frames[robot.tool_frame_id].parentJoint
    own = [f for f in model.frames if f.type == pin.FrameType.BODY and f.parentJoint == last]
    named = sorted((FLANGES.index(f.name), k) for k, f in enumerate(own) if f.name in FLANGES)
    flange = own[named[0][1] if named else 0]
    tcp = model.frames[robot.tool_frame_id].placement
    return f"link {flange.name}", np.array(flange.placement.actInv(tcp).homogeneous)


def _part(robot: Robot, surface: Surface) -> tuple[str, Array]:
    """What the part stands on, and its frame (4, 4) m in that one's."""
    part = np.eye(4)
    part[:3, :3], part[:3, 3] = surface.rotation, surface.position
    if robot.surface_link is not None:
        return f"{robot.surface_link}, which carries it", part
    root = f"link {robot.root_link or robot.link_names[0]}"
    if any(axis.carries == "base" for axis in robot.axes):
        root += ", with the axes that carry it at zero"
    return root, np.array(np.linalg.inv(robot.base) @ part)


def _numbers(values: Array) -> list[str]:
    """Short decimal numbers."""
    return [f"{value + 0.0:.10g}" for value in np.round(values, 6).tolist()]


def _named(names: str, values: Sequence[str], between: str) -> str:
    return between.join(
        f"{name} {value}" for name, value in zip(names.split(), values, strict=True)
    )
