"""The joints of an arm as the axes of a controller.

The joints of the URDF have to be those of the controller: six that turn, from base to flange, in
this order. Where signs or zeros differ, the user gives them:

    axis = sign * joint + offset

A FANUC controller counts J3 from the horizontal, a URDF joint 3 from the upper arm. So joint 2 is
added to it, or taken from it where the two axes point to opposite sides, as in the URDFs of
ROS-Industrial:

    J3 = sign * (joint 3 +- joint 2) + offset

An axis that carries arm or part (`[[robot.axis]]`), or a joint that slides, becomes an external
axis where the language has them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array
from coverable.errors import Checks, CoverableError, Fault
from feasibility.programs.controllers import INFORM, TP, Language
from robots.kinematics import Kinematics
from robots.robot import Robot

JOINTS = 6  # of the arm itself, in every language
SECOND, THIRD = 1, 2  # axes of the arm
PARALLEL = 1e-4  # [1] how far the product of two unit vectors may be from 1: axes as calibrated
LONGEST_TEXT = 120  # characters of a line that switches the tool


class ProgramError(CoverableError):
    """An arm that has no program in a language, or settings that make none."""


@dataclass(frozen=True, slots=True)
class ProgramSettings:
    """What a program needs that neither robot nor trajectory say."""

    signs: Sequence[float] | None = None
    """(6,) 1 or -1 for each axis of the arm; 1 by default."""
    offsets_deg: Sequence[float] | None = None
    """(6,) degrees that are added to each; 0 by default."""
    pulses_per_deg: Sequence[float] | None = None
    """(6,) of the axes of a Yaskawa arm; they are in its controller's parameters, and needed."""
    j3_from_horizontal: bool = True
    """Of a FANUC arm: False where J3 is counted from the upper arm, as the URDF's joint is."""
    on: str = ""
    """A line of the language for the beginning of each stretch in which the tool works."""
    off: str = ""
    """The same for its end."""


@dataclass(frozen=True, eq=False, slots=True)
class AxisMap:
    """Joints as the axes of a controller, in the unit of its language; external ones deg or mm."""

    language: Language
    arm: tuple[int, ...]
    """The joints that are the arm's axes 1 to 6."""
    external: tuple[int, ...]
    """Those that are external axes, in order."""
    signs: Array
    """(6,) of the arm's axes."""
    offsets_deg: Array
    """(6,) degrees."""
    per_deg: Array
    """(6,) of the language's unit in a degree."""
    j3_by_j2: float
    """How much of joint 2 belongs to axis 3: 0, 1 or -1."""

    def words(self, robot: Robot) -> list[str]:
        """A line for each axis: what it is called, which joint it is, and its unit."""
        names, lines = robot.joint_names, []
        for k, joint in enumerate(self.arm):
            terms = [(self.signs[k], names[joint])]
            if k == THIRD and self.j3_by_j2:
                terms.append((self.signs[k] * self.j3_by_j2, names[self.arm[SECOND]]))
            if self.offsets_deg[k]:
                offset = float(self.offsets_deg[k])
                terms.append((offset, f"{abs(offset):g} deg"))
            text = "".join(f" {'-' if sign < 0 else '+'} {name}" for sign, name in terms)
            text = text.removeprefix(" + ").replace(" - ", "-", 1 if text.startswith(" - ") else 0)
            unit = f"in {self.language.unit}"
            if self.language is INFORM:
                unit = f"{self.per_deg[k]:.10g} pulses per deg"
            lines.append(f"{self.language.axes[k]} = {text}, {unit}")
        if self.language is INFORM:
            largest = np.degrees(robot.max_velocity[list(self.arm)]).tolist()
            speeds = ", ".join(f"{speed:.4g}" for speed in largest)
            lines.append(f"VJ is a share of {speeds} deg/s (S to T), which are the URDF's: times "
                         "hold where the controller's are the same.")  # fmt: skip
        if self.j3_by_j2:
            lines.append("J3 is counted from the horizontal, as FANUC's controllers show it.")
        for k, joint in enumerate(self.external):
            slides = bool(robot.prismatic[joint])
            name = self.language.external[k]
            lines.append(f"{name} = {names[joint]}, in {'mm' if slides else 'deg'}")
        return lines

    def values(self, robot: Robot, q: Array) -> tuple[Array, Array]:
        """Axes of the arm (m, 6) and external ones (m, e) of configurations q (m, n), rounded.

        Rounding leaves no joint outside its limits.
        """
        units = np.where(robot.prismatic, 1e3, math.degrees(1.0))
        signs, shift = np.ones(robot.n), np.zeros(robot.n)
        arm, digits = list(self.arm), self.language.digits
        units[arm], signs[arm] = math.degrees(1.0) * self.per_deg, self.signs
        shift[arm] = self.offsets_deg * self.per_deg
        ends = [signs * limit * units + shift for limit in (robot.lower, robot.upper)]
        low, high = np.minimum(*ends), np.maximum(*ends)
        step = 10.0**-digits
        rounded = np.round(q * signs * units + shift, digits)
        rounded = np.where(rounded < low, rounded + step, rounded)
        rounded = np.where(rounded > high, rounded - step, rounded)
        axes = rounded[:, arm]
        second = self.signs[SECOND] * (axes[:, SECOND] - shift[arm[SECOND]])
        axes[:, THIRD] += self.signs[THIRD] * self.j3_by_j2 * second
        return axes.round(digits), rounded[:, list(self.external)]


def check_program(
    language: Language, robot: Robot, settings: ProgramSettings | None = None
) -> AxisMap:
    """The joints of an arm as the axes of a controller.

    Raises:
        ProgramError: the joints are no such axes, or the settings make no program.
    """
    settings = ProgramSettings() if settings is None else settings
    checks = Checks(f"{language.name} for {robot.name!r}", ProgramError)
    arm, outside = _axes(checks, language, robot)
    expected = f"must be {JOINTS} numbers, one for each axis of the arm"
    signs = _six(checks, "signs", settings.signs, 1.0, f"{expected}, 1 or -1")
    if not np.isin(signs, (-1.0, 1.0)).all():
        checks.wrong("signs", settings.signs, f"{expected}, 1 or -1")
    offsets = _six(checks, "offsets_deg", settings.offsets_deg, 0.0, f"{expected} (degrees)")
    per_deg = _per_deg(checks, language, robot, arm, settings)
    for name, text in (("on", settings.on), ("off", settings.off)):
        if any(not " " <= c <= "~" for c in text) or len(text) > LONGEST_TEXT:
            expected = f"must be one line of plain ASCII, of {LONGEST_TEXT} characters at most"
            checks.wrong(name, text, expected)
        elif not text.strip() and (text or settings.on or settings.off):
            checks.keep(Fault(name, "is missing: on and off go together; give a comment of the "
                              "language where there is nothing to do"))  # fmt: skip
    by_j2 = 0.0
    if language is TP and settings.j3_from_horizontal and len(arm) == JOINTS:
        _, _, twists = Kinematics(robot).tools_and_twists(np.zeros((1, robot.n)))
        product = float(twists[0, 3:, arm[SECOND]] @ twists[0, 3:, arm[THIRD]])
        by_j2 = math.copysign(1.0, product) if abs(product) >= 1.0 - PARALLEL else 0.0
        if not by_j2:
            what = f"{robot.joint_names[arm[SECOND]]} and {robot.joint_names[arm[THIRD]]}"
            fault = f"J3 is counted from the horizontal, but {what} have no parallel axes"
            wanted = "where it is counted from the upper arm, say --j3-from-upper-arm"
            checks.keep(Fault("", fault, expected=wanted))
    checks.done()
    return AxisMap(language, arm, outside, signs, offsets, per_deg, by_j2)


def _axes(
    checks: Checks, language: Language, robot: Robot
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """The joints that are axes of the arm, and those that are external ones."""
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
        named = ", ".join(robot.joint_names[j] for j in outside)
        most = f"{len(language.external) or 'no'} external axes"
        checks.keep(Fault("", f"{language.name} is written with {most} here; there are {named}"))
    return tuple(arm), tuple(outside)


def _per_deg(
    checks: Checks, language: Language, robot: Robot, arm: Sequence[int], settings: ProgramSettings
) -> Array:
    """(6,) of the language's unit in a degree."""
    if language is not INFORM:
        return np.full(JOINTS, math.radians(1.0) if language.unit == "rad" else 1.0)
    if not (robot.max_velocity[list(arm)] > 0.0).all():
        checks.keep(Fault("", "speeds of a job are shares of the axes' largest ones (VJ), and the "
                          "URDF gives no velocity limits"))  # fmt: skip
    expected = (
        "must be six numbers > 0, pulses of each axis per degree (S, L, U, R, B, T), which are in "
        "the controller's parameters: a job has no angles"
    )
    if settings.pulses_per_deg is None:
        checks.keep(Fault("pulses_per_deg", "is missing", expected=f"it {expected}"))
        return np.ones(JOINTS)
    found = _six(checks, "pulses_per_deg", settings.pulses_per_deg, 1.0, expected)
    if not (found > 0.0).all():
        checks.wrong("pulses_per_deg", settings.pulses_per_deg, expected)
    return found


def _six(
    checks: Checks, name: str, given: Sequence[float] | None, usual: float, expected: str
) -> Array:
    """Six numbers, or the usual one six times."""
    found = None if given is None else checks.numbers(name, given, JOINTS, expected, 1e6)
    return np.full(JOINTS, usual) if found is None else np.array(found, dtype=float)
