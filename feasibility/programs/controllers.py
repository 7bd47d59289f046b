"""Which arm speaks which language, and its joints as the axes of a controller.

A program names axes by their number, so the joints of the URDF have to be those of the controller:
six that turn, from base to flange, in this order. Where signs or zeros differ, the user gives them:

    axis = sign * joint + offset

An axis that carries arm or part (`[[robot.axis]]`), or a joint that slides, becomes an external
axis where the language has them.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coverable_arrays import Array
from coverable_errors import Checks, CoverableError, Fault
from feasibility.safe_files import FileError, shown_path
from robots import Robot

JOINTS = 6  # of the arm itself, in every language
MOST_EXTERNAL = 6


class ProgramError(CoverableError):
    """An arm that has no program in a language."""


@dataclass(frozen=True, slots=True)
class Language:
    """One language of programs."""

    name: str
    ending: str
    """Of its files, by which it is chosen."""
    maker: str
    external: tuple[str, ...]
    """What it calls external axes; none where it has none."""
    axes: str
    """What the axes of the arm are called, `{}` for the number."""
    period: float
    """s between points, by default."""


URSCRIPT = Language("URScript", "script", "Universal Robots", (), "joint {}", 0.02)
RAPID = Language(
    "RAPID", "mod", "ABB", tuple(f"eax_{letter}" for letter in "abcdef"), "rax_{}", 0.1
)
KRL = Language("KRL", "src", "KUKA", tuple(f"E{k + 1}" for k in range(MOST_EXTERNAL)), "A{}", 0.1)
LANGUAGES = (URSCRIPT, RAPID, KRL)

MAKERS = (
    ("Universal Robots", r"ur\d+e?|universal"),
    ("ABB", r"abb|irb.*|crb.*"),
    ("KUKA (Sunrise, in Java)", r"iiwa.*|lbr.*"),
    ("KUKA", r"kuka|kr\d.*|agilus|quantec"),
    ("Unimation", r"puma.*"),
    ("Franka", r"panda|franka|fr3|fer"),
    ("Kinova", r"kinova|jaco.*|j2[sn]\d.*|gen3.*"),
    ("UFACTORY", r"xarm.*|lite6|uf850"),
    ("Unitree", r"z1|b1"),
    ("the SO-ARM project", r"so10\d"),
    ("PAL Robotics", r"talos.*|tiago.*"),
    ("Rethink", r"baxter|sawyer"),
    ("Willow Garage", r"pr2"),
    ("IIT", r"centauro"),
    ("ANYbotics", r"anymal"),
    ("FANUC", r"fanuc|lrmate.*|crx.*|m\d+i[a-d].*"),
    ("Staubli", r"staubli|tx2?\d.*"),
    ("Yaskawa", r"yaskawa|motoman|gp\d+|hc\d+"),
)
"""Makers, and the words in the names of their arms."""


def language_of(path: str | os.PathLike[str]) -> Language:
    """The language of a file's ending.

    Raises:
        FileError: it is no ending of a program.

    Example:
        >>> language_of("cell.mod").name
        'RAPID'
    """
    ending = Path(path).suffix.lower().lstrip(".")
    for language in LANGUAGES:
        if language.ending == ending:
            return language
    raise FileError(
        "expected a name that ends in .script (URScript), .mod (RAPID) or .src (KRL): a program",
        shown_path(path),
    )


def maker_of(name: str) -> str:
    """Who makes an arm of this name; empty where that is not known.

    Example:
        >>> maker_of("ur10_limited"), maker_of("my_irb1200_5_90"), maker_of("paint arm")
        ('Universal Robots', 'ABB', '')
    """
    words = re.split(r"[^a-z0-9]+", name.lower())
    for maker, pattern in MAKERS:
        if any(re.fullmatch(pattern, word) for word in words):
            return maker
    return ""


@dataclass(frozen=True, eq=False, slots=True)
class AxisMap:
    """Joints as the axes of a controller, in degrees or mm; of URScript in rad."""

    language: Language
    arm: tuple[int, ...]
    """The joints that are the arm's axes 1 to 6."""
    external: tuple[int, ...]
    """Those that are external axes, in order."""
    signs: Array
    """(6,) of the arm's axes."""
    offsets_deg: Array
    """(6,) degrees."""

    def words(self, robot: Robot) -> list[str]:
        """A line for each axis: what it is called, which joint it is, and its unit."""
        lines = []
        for k, joint in enumerate(self.arm):
            sign, offset = ("" if self.signs[k] > 0 else "-"), float(self.offsets_deg[k])
            plus = f" {'+' if offset > 0 else '-'} {abs(offset):g} deg" if offset else ""
            unit = "rad" if self.language is URSCRIPT else "deg"
            name = self.language.axes.format(k + 1)
            lines.append(f"{name} = {sign}{robot.joint_names[joint]}{plus}, in {unit}")
        for k, joint in enumerate(self.external):
            unit = "mm" if robot.prismatic[joint] else "deg"
            lines.append(f"{self.language.external[k]} = {robot.joint_names[joint]}, in {unit}")
        return lines

    def values(self, robot: Robot, q: Array, digits: int) -> tuple[Array, Array]:
        """Axes of the arm (m, 6) and external ones (m, e) of configurations q (m, n), rounded.

        Numbers in degrees and mm, for URScript in rad. Rounding leaves no joint outside its limits.
        """
        turn = 1.0 if self.language is URSCRIPT else math.degrees(1.0)
        offsets = self.offsets_deg * (turn / math.degrees(1.0))
        units = np.where(robot.prismatic, 1e3, turn)
        signs, shift = np.ones(robot.n), np.zeros(robot.n)
        arm = list(self.arm)
        signs[arm], shift[arm] = self.signs, offsets
        ends = [signs * limit * units + shift for limit in (robot.lower, robot.upper)]
        low, high = np.minimum(*ends), np.maximum(*ends)
        step = 10.0**-digits
        rounded = np.round(q * signs * units + shift, digits)
        rounded = np.where(rounded < low, rounded + step, rounded)
        rounded = np.where(rounded > high, rounded - step, rounded)
        return rounded[:, arm], rounded[:, list(self.external)]


def check_program(
    language: Language,
    robot: Robot,
    signs: Sequence[float] | None = None,
    offsets_deg: Sequence[float] | None = None,
) -> AxisMap:
    """The joints of an arm as the axes of a controller.

    Args:
        language: of the program.
        robot: the arm.
        signs: (6,) 1 or -1 for each axis of the arm; 1 by default.
        offsets_deg: (6,) degrees that are added to each; 0 by default.

    Raises:
        ProgramError: the arm is of another maker, its joints are no such axes, or signs or offsets
            are not six numbers.
    """
    where = f"{language.name} for {robot.name!r}"
    maker = maker_of(robot.name)
    if maker not in ("", language.maker):
        fault = f"{language.name} is for arms of {language.maker}; {robot.name!r} is of {maker}"
        raise ProgramError(fault)
    checks = Checks("", ProgramError)
    carrying = {axis.name for axis in robot.axes}
    if robot.surface_link is not None and robot.surface_link not in carrying:
        checks.keep(Fault("", "an arm that holds the part, or a part on a link of its URDF, has no "
                          "program: the order of its axes is not known"))  # fmt: skip
    outside = [
        j for j, name in enumerate(robot.joint_names) if name in carrying or robot.prismatic[j]
    ]
    arm = [j for j in range(robot.n) if j not in outside]
    if len(arm) != JOINTS:
        checks.keep(Fault("", f"it needs {JOINTS} joints that turn; {len(arm)} of them move here"))
    if len(outside) > len(language.external):
        most = f"has no more than {len(language.external)}" if language.external else "has no"
        named = ", ".join(robot.joint_names[j] for j in outside)
        checks.keep(Fault("", f"{language.name} {most} external axes; there are {named}"))
    expected = f"must be {JOINTS} numbers, one for each axis of the arm"
    kept = [
        _six(checks, "signs", signs, 1.0, f"{expected}, 1 or -1"),
        _six(checks, "offsets_deg", offsets_deg, 0.0, f"{expected} (degrees)"),
    ]
    if not np.isin(kept[0], (-1.0, 1.0)).all():
        checks.wrong("signs", signs, f"{expected}, 1 or -1")
    try:
        checks.done()
    except ProgramError as error:
        raise ProgramError(error.faults, where) from error
    return AxisMap(language, tuple(arm), tuple(outside), *kept)


def _six(
    checks: Checks, name: str, given: Sequence[float] | None, usual: float, expected: str
) -> Array:
    """Six numbers, or the usual one six times."""
    found = None if given is None else checks.numbers(name, given, JOINTS, expected, 1e4)
    return np.full(JOINTS, usual) if found is None else np.array(found, dtype=float)
