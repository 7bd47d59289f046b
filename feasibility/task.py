"""The task: how the tool is to be held over the surface (eqs. 1 to 4 of the paper)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from coverable.arrays import Array, unit_along
from coverable.errors import ArgumentError, Checks, Fault
from feasibility.cone import chord_of
from surfaces.cells import Cells

if TYPE_CHECKING:
    from feasibility.collisions.settings import Collision
    from feasibility.roll import Roll

DEFAULT_TOLERANCE = 1e-3  # [m]
FIXED_DEG = 0.1  # [deg] to either side: a range that counts as "fixed"


class Targets(NamedTuple):
    """A task applied to cells: where the tool point has to be, and where its axis points."""

    points: Array
    """(N, 3) m, in the root frame: centre -+ standoff * normal."""
    approaches: Array
    """(N, 3) unit: +normal for the inside of a surface, -normal for the outside, unless the task or
    the cells have others."""
    references: Array | None = None
    """(N, 3) unit, square to the approaches: where the reference axis of the TCP points at a roll
    of 0; None where the roll is free."""


Direction = tuple[float, float, float]


class PlacementError(NamedTuple):
    """How far off the surface may stand from where the case says."""

    position: float
    """m."""
    angle_deg: float
    """deg, about the middle of the cells."""


@dataclass(frozen=True, slots=True)
class Task:
    """Hold the tool point at a standoff from the surface, the axis within a cone, the arm clear.

    Example:
        >>> task = Task(standoff=0.005, cone_deg=45)
        >>> round(task.cone, 4)
        0.7854
        >>> task.effective_tolerance
        0.001

    Raises:
        ArgumentError: standoff or tolerance is negative or not finite, the cone is outside 0 to
            180 degrees, a direction is none, the range of the roll is empty, or limited with a
            cone over 90 degrees, or a coverage has no footprint; all that is wrong is named.
    """

    standoff: float
    """d, metres between surface and tool point."""
    cone_deg: float
    """alpha, the largest angle in degrees between tool axis and approach direction."""
    tolerance: float | None = None
    """How far the tool point may deviate from its target surface, metres. None leaves it to the
    method: `DEFAULT_TOLERANCE` for the complete search, step times reach for the greedy one; the
    verdict states what was used."""
    collision: Collision | None = None
    """What the arm has to stay clear of; None where collisions are not checked."""
    approach: Literal["normal"] | Direction | None = None
    """b(u, v), eq. (3): towards the surface along its normal, or one direction (of any length, in
    the surface's own frame) all over it. None leaves it to the cells: poses may have approaches of
    their own, all other cells have the normal. The target stays on the normal in any case."""
    roll_deg: tuple[float, float] | None = None
    """The least and the largest roll, degrees: the angle about the approach direction from the
    reference direction on the surface to the reference axis of the TCP (`feasibility.roll`). None,
    or 360 degrees and more, leaves it free. One roll alone, such as (0, 0), means that one up to
    `FIXED_DEG` to either side, for without a margin no motion could be certified; then a cone of 0
    is one of `FIXED_DEG` too, and the orientation is fixed: eq. (2)."""
    roll_reference: Direction | None = None
    """The reference direction in the surface's own frame; its part square to the approach counts.
    None for the direction in which u grows, or the tangents of poses."""
    footprint: float | tuple[float, float] | None = None
    """What the tool treats at once, metres: the diameter of a disc, or an ellipse's along its path
    and across. Answers then have the treated share of the area; it alone changes no verdict."""
    coverage: float | None = None
    """The share of the area that has to be treated for "feasible", in addition to every cell."""

    speed: float | None = None
    """m/s, of the tool relative to the surface: what the joints' velocity limits have to allow all
    along the motion, but where it stops (`feasibility.certification.rate_replay`). None for any."""
    min_manipulability: float | None = None
    """What the smallest singular value along the motion has to be at least: of the Jacobian of tool
    point (over the arm's reach) and approach axis, a pure number. None for any."""
    smooth: float | None = None
    """m, for meshes: targets and approach directions are those of a copy of the surface smoothed
    over this length (`surfaces.meshes.smoothed`). How far the copy is off the surface is stated,
    and taken off the tolerance; where it is more than that, the tolerance holds from the copy. None
    for the surface itself."""
    placement_error: PlacementError | tuple[float, float] | None = None
    """m, degrees: "feasible" then says that a continuous motion exists wherever the surface stands
    within that of where the case says; a pair is taken as a `PlacementError`. None for there."""
    home_deg: tuple[float, ...] | None = None
    """(n,) degrees, where a path comes from and goes back to; None where it begins and ends over
    the surface. For arms whose joints all turn."""

    def __post_init__(self) -> None:
        """Refuse numbers that describe no task; keep them as plain floats."""
        checks = Checks("task")
        kept: dict[str, Any] = {
            "standoff": checks.number(
                "standoff", self.standoff, "must be a finite number >= 0 (metres)", low=0.0
            ),
            "cone_deg": checks.number(
                "cone_deg", self.cone_deg, "must lie in 0 .. 180 (degrees)", 0.0, 180.0
            ),
        }
        units = {
            "tolerance": "metres",
            "speed": "m/s",
            "min_manipulability": "a pure number",
            "smooth": "metres",
        }
        for name, unit in units.items():
            if getattr(self, name) is not None:
                kept[name] = checks.positive(name, getattr(self, name), unit)
        asked = self.collision
        if asked is not None:
            from feasibility.collisions.settings import Collision

            if not isinstance(asked, Collision):
                expected = "must be a Collision, such as Collision(clearance=0.005), or None"
                checks.wrong("collision", self.collision, expected)
        kept["approach"] = self._checked_approach(checks)
        kept["roll_deg"] = roll = self._checked_roll(checks, kept["cone_deg"])
        if self.roll_reference is not None:
            reference = checks.direction("roll_reference", self.roll_reference)
            kept["roll_reference"] = tuple(reference)
        kept["footprint"] = self._checked_footprint(checks)
        kept["coverage"] = self._checked_coverage(checks)
        kept["placement_error"] = self._checked_placement_error(checks)
        kept["home_deg"] = self._checked_home(checks)
        checks.done()
        if roll is not None and roll[0] == roll[1]:
            kept["roll_deg"] = _about(roll[0])
            kept["cone_deg"] = kept["cone_deg"] or FIXED_DEG
        for name, value in kept.items():
            object.__setattr__(self, name, value)

    def _checked_footprint(self, checks: Checks) -> float | tuple[float, float] | None:
        """The footprint as one diameter or two."""
        given = self.footprint
        if given is None or not isinstance(given, (list, tuple)):
            return None if given is None else checks.positive("footprint", given)
        expected = "must be a diameter > 0, or two such as [0.06, 0.04] (metres)"
        found = checks.numbers("footprint", given, 2, expected)
        if found is None:
            return None
        if min(found) <= 0.0:
            checks.wrong("footprint", given, expected)
        return found[0], found[1]

    def _checked_coverage(self, checks: Checks) -> float | None:
        """The share that has to be treated, which needs a footprint."""
        if self.coverage is None:
            return None
        expected = "must be a share above 0 and up to 1, such as 0.99"
        known = len(checks.faults)
        share = checks.number("coverage", self.coverage, expected, 0.0, 1.0)
        if share == 0.0 and len(checks.faults) == known:
            checks.wrong("coverage", self.coverage, expected)
        if self.footprint is None:
            expected = "give task.footprint, in metres, or leave coverage out"
            checks.keep(Fault("coverage", "needs a footprint to measure", expected=expected))
        return share

    def _checked_placement_error(self, checks: Checks) -> PlacementError | None:
        """Shift and turn, neither below zero."""
        given: Any = self.placement_error
        if given is None:
            return None
        expected = "must be a shift and a turn >= 0, such as { position = 0.003, angle_deg = 0.2 }"
        if isinstance(given, Mapping):
            known = dict.fromkeys(PlacementError._fields, 0.0)
            given = list({**known, **given}.values())
        found = checks.numbers("placement_error", given, 2, expected)
        if found is None:
            return None
        if min(found) < 0.0 or found[1] > 180.0:
            checks.wrong("placement_error", given, expected)
        return PlacementError(*found)

    def _checked_approach(self, checks: Checks) -> Any:
        """The approach as a word or three numbers."""
        if self.approach is None or isinstance(self.approach, str):
            if self.approach not in (None, "normal"):
                expected = "must be 'normal' or a direction, such as (0, 0, -1)"
                checks.wrong("approach", self.approach, expected)
            return self.approach
        return tuple(checks.direction("approach", self.approach))

    def _checked_home(self, checks: Checks) -> tuple[float, ...] | None:
        """Numbers, one for each joint, as many as there are; the arm is not known here."""
        if self.home_deg is None:
            return None
        count = np.size(self.home_deg) if np.ndim(self.home_deg) == 1 else 1
        expected = "must be finite numbers, one per joint (degrees)"
        found = checks.numbers("home_deg", self.home_deg, max(count, 1), expected, 1e6)
        return None if found is None else tuple(found)

    def _checked_roll(self, checks: Checks, cone_deg: Any) -> tuple[float, float] | None:
        """The range of the roll, which may be a single one."""
        if self.roll_deg is None:
            return None
        expected = "must be a pair (low, high) of degrees in -360 .. 360 with low <= high"
        found = checks.numbers("roll_deg", self.roll_deg, 2, expected, 360.0)
        if found is None:
            return None
        low, high = found
        if low > high:
            checks.wrong("roll_deg", self.roll_deg, f"{expected}; this range is empty")
        elif high - low < 360.0 and cone_deg > 90.0:
            expected = (
                "must be 90 or less where roll_deg is limited: beyond that a roll means little"
            )
            checks.wrong("cone_deg", cone_deg, expected)
        return low, high

    @property
    def cone(self) -> float:
        """The half angle alpha of the cone, radians."""
        return math.radians(self.cone_deg)

    @property
    def disc(self) -> tuple[float, float] | None:
        """m, the footprint along the path and across it; None where none is given."""
        given = self.footprint
        return given if given is None or isinstance(given, tuple) else (given, given)

    @property
    def smoothing(self) -> tuple[float, float] | None:
        """m, length and tolerance for `surfaces.meshes.smoothed`; None for the surface itself."""
        return None if self.smooth is None else (self.smooth, self.effective_tolerance)

    @property
    def requires_rates(self) -> bool:
        """Is a speed, or a distance from singularities, required?"""
        return self.speed is not None or self.min_manipulability is not None

    @property
    def effective_tolerance(self) -> float:
        """The tolerance, m; where it is left to the method, that of the complete search."""
        return DEFAULT_TOLERANCE if self.tolerance is None else self.tolerance

    @property
    def cone_chord(self) -> float:
        """The length of a - b at the boundary of the cone, 0 .. 2; inf where any axis will do."""
        return chord_of(self.cone)

    @property
    def roll(self) -> Roll | None:
        """The range of the roll, rad; None where it is free."""
        if self.roll_deg is None:
            return None
        from feasibility.roll import roll_of_range

        return roll_of_range(*self.roll_deg)

    def fixed_approach(self, cells: Cells) -> Array | None:
        """(3,) unit, in the root frame, where the approach is one direction; None elsewhere."""
        if self.approach is None or isinstance(self.approach, str):
            return None
        return cells.surface.rotation @ unit_along(self.approach)

    def fixed_reference(self, cells: Cells) -> Array | None:
        """(3,) unit, in the root frame, of `roll_reference`; None where there is none."""
        if self.roll_reference is None:
            return None
        return cells.surface.rotation @ unit_along(self.roll_reference)

    def along_normals(self, cells: Cells) -> bool:
        """Whether the approach directions are the normals of the surface, towards it."""
        own = self.approach is None and cells.approaches is not None
        return self.fixed_approach(cells) is None and not own

    def approaches(self, cells: Cells) -> Array:
        """(N, 3) unit approach directions b of the cell centres, in the root frame."""
        fixed = self.fixed_approach(cells)
        if fixed is not None:
            return np.tile(fixed, (len(cells), 1))
        if self.approach is None and cells.approaches is not None:
            return cells.approaches
        return -cells.surface.side_sign * cells.normals

    def targets(self, cells: Cells) -> Targets:
        """Targets c_p(u, v), eq. (1), approaches b(u, v), eq. (3), and reference directions.

        All of the cell centres; NaN in place of a reference that is along its approach.

        Raises:
            ArgumentError: the roll is limited, but neither task nor cells have a reference.
        """
        approaches = self.approaches(cells)
        return Targets(
            points=cells.centres + cells.surface.side_sign * self.standoff * cells.normals,
            approaches=approaches,
            references=self._references(cells, approaches),
        )

    def _references(self, cells: Cells, approaches: Array) -> Array | None:
        if self.roll is None:
            return None
        fixed, directions = self.fixed_reference(cells), cells.tangents
        if fixed is not None:
            directions = np.broadcast_to(fixed, approaches.shape)
        if directions is None:
            raise ArgumentError(
                Fault(
                    "roll_reference",
                    "is missing: there is no u direction on a mesh, on poses or along passes",
                    expected="give a direction along it, in its own frame, such as (1, 0, 0)",
                ),
                "task",
            )
        from feasibility.roll import projected

        return projected(directions, approaches)[0]


def check_footprint(cells: Cells, task: Task) -> None:
    """Refuse a footprint where there is no surface to treat.

    Raises:
        ArgumentError: the cells are poses.
    """
    if task.footprint is not None and cells.surface.wall is None:
        expected = "leave it out, or plan passes over the surface itself"
        what = "is given, but between poses there is no surface to treat"
        raise ArgumentError(Fault("footprint", what, expected=expected), "task")


def check_smooth(cells: Cells, task: Task) -> None:
    """Refuse cells of a surface that is not smoothed as the task says.

    Raises:
        ArgumentError: it is not, or was for another tolerance.
    """
    made, wanted = cells.surface.smoothing, task.smooth
    if made is None or wanted is None:
        fits = made is None and wanted is None
    else:
        counted = made.off < task.effective_tolerance
        fits = made.length == wanted and made.counted == counted
    if not fits:
        how = f"smoothed over {made.length:g} m" if made else "not smoothed"
        what = (
            f"is {wanted}, but the cells are of a surface that is {how}, or for another tolerance"
        )
        expected = "cut smoothed(mesh, task.smooth, task.effective_tolerance) into cells"
        raise ArgumentError(Fault("smooth", what, expected=expected), "task")


def _about(roll_deg: float) -> tuple[float, float]:
    """The range of a roll that is fixed, within -360 .. 360 degrees.

    Example:
        >>> _about(0.0), _about(360.0)
        ((-0.1, 0.1), (-0.1, 0.1))
    """
    middle = math.fmod(roll_deg, 360.0)
    return middle - FIXED_DEG, middle + FIXED_DEG
