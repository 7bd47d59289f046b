"""What is said about a surface, and why: the verdict, its evidence, and a cause per missed cell."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from coverable.arrays import Array, Ints, Mask
from coverable.errors import at_least
from feasibility.collisions.asked_bodies import said_of
from feasibility.task import Task
from robots.robot import Robot
from surfaces.cells import Cells

if TYPE_CHECKING:
    import networkx as nx

    from feasibility.cut_tree import CutTree
    from robots.shapes.link_pairs import LeftOut


class Answer(StrEnum):
    """Can one continuous motion cover the surface?"""

    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    UNDECIDED = "undecided"


class Evidence(StrEnum):
    """What an answer rests on."""

    WITNESS = "witness"
    """A covering motion that an independent replay accepted."""
    PROOF = "proof"
    """A bound that rules a cell out, or a cut tree that parts the cells."""
    EXHAUSTED = "exhausted"
    """The search ended at its stated resolution without finding a covering motion."""
    BUDGET = "budget"
    """The search was stopped before it ended."""


class Decision(NamedTuple):
    """An answer, its evidence and the sentences about it."""

    answer: Answer
    evidence: Evidence
    message: str


class CauseKind(StrEnum):
    """Why a cell is missed."""

    OUT_OF_REACH = "out_of_reach"
    JOINT_LIMITS = "joint_limits"
    ORIENTATION = "orientation"
    COLLISION = "collision"
    DISCONNECTED = "disconnected"


@dataclass(frozen=True, slots=True)
class Cause:
    """Why one cell is not covered."""

    cell: int
    """Flat index of the cell."""
    kind: CauseKind
    proved: bool
    """True where a bound shows it; False where a search ended without finding a motion."""
    detail: str
    """One sentence with the figures: by how much, which joint, which angle."""
    pair: tuple[str, str] | None = None
    """What would collide, where that is the cause."""
    clearance: float | None = None
    """m, the distance of that pair at best; negative where they overlap."""


@dataclass(frozen=True, eq=False, slots=True)
class Walk:
    """One continuous motion: straight lines in joint space between waypoints."""

    q: Array
    """(m, n) waypoints, rad or m, unwrapped."""
    cell: Ints
    """(m,) flat index of the cell whose centre target the tool point is at; -1 between centres."""


class Bound(StrEnum):
    """What leaves least room to displace the surface."""

    LIMIT = "limit"
    CONE = "cone"
    ROLL = "roll"
    SINGULAR = "singular"
    CLEARANCE = "clearance"
    START = "start"
    """The motion has to begin there, wherever the surface stands."""


ROOM = {
    Bound.LIMIT: ("{}'s limit", "a wider limit of {}"),
    Bound.CONE: ("the cone", "a wider cone"),
    Bound.ROLL: ("the range of the roll", "a wider range of the roll"),
    Bound.SINGULAR: (
        "the arm is near a singularity",
        "another place of the part, further from singularities (coverable place)",
    ),
    Bound.CLEARANCE: (
        "the clearance of {}",
        "less clearance of {}, or a place further from what is in the way",
    ),
    Bound.START: ("the start", "a motion that may begin elsewhere (without robot.start)"),
}
"""What leaves least room, and what would widen it."""


@dataclass(frozen=True, eq=False, slots=True)
class PlacementMargin:
    """Where the surface may stand, as displaced against the arm, so that a motion still exists.

    Anywhere with shift / position + turn / angle <= 1; see `certification.placement_margin`.
    """

    position: float
    """m, how far it may be shifted; 0 where there is no margin."""
    angle: float
    """rad, how far it may be turned about `pivot`."""
    pivot: tuple[float, ...]
    """(3,) m, in the root frame: the middle of the cells."""
    bound_by: Bound
    """What leaves least room to shift it."""
    cell: tuple[int, ...]
    """The index of the cell next to where that is."""
    what: str = ""
    """The joint whose limit that is, or the two bodies."""
    along: Array | None = None
    """(m - 1,) m, how far the surface may be shifted for each segment; None with a start."""

    def share(self, position: float, angle_deg: float) -> float:
        """The share of it that an error of so many m and degrees uses: up to 1 it is certified."""
        parts = (position, self.position), (math.radians(angle_deg), self.angle)
        return sum(0.0 if not a else a / b if b else math.inf for a, b in parts)

    def __str__(self) -> str:
        """What is certified, and what leaves least room."""
        if self.bound_by is Bound.START:
            return "no margin: the motion begins at the start, wherever the part stands"
        shift, turn = at_least(1e3 * self.position, 3), at_least(math.degrees(self.angle), 3)
        held = f"within {shift} mm, or turned by up to {turn} deg about its middle"
        least = ROOM[self.bound_by][0].format(self.what)
        return f"{held}; least room: {least} at cell {list(self.cell)}"


@dataclass(frozen=True)  # no slots: the margin is kept in its __dict__
class Certificate:
    """What an independent replay of the witness measured, between waypoints too."""

    waypoints: int
    max_position_error: float
    """m, bound on the distance of the tool point from its target surface along the walk."""
    max_angle: float
    """rad, bound on the angle between tool axis and approach direction along the walk."""
    min_limit_margin: float
    """rad or m, smallest distance of a joint from a limit."""
    min_clearance: float | None = None
    """m, certified lower bound on the distance of any pair of bodies along the walk, of the exact
    shapes. None where collisions are not checked, or there is no pair."""
    measured_clearance: float | None = None
    """m, the least distance of exact bodies that coal measured along the walk: the truth lies
    between `min_clearance` and this."""
    nearest_pair: tuple[str, str] | None = None
    """Links, objects of the scene, 'tool' or 'surface': the two that `min_clearance` is of."""
    max_roll: float | None = None
    """rad, bound on how far the roll is from the middle of its range along the walk; None where it
    is free."""
    max_speed: float | None = None
    """m/s, lower bound of the speed that the tool may have all along but for the stops, inside the
    joints' velocity limits; None where the task has none."""
    min_singular_value: float | None = None
    """Lower bound of the smallest singular value along the walk; None where the task has none."""
    stops_in_place: int | None = None
    """How often the tool waits while the arm changes its posture; None as for the speed."""
    corners: int | None = None
    """At how many rows the tool's path turns sharply; None as for the speed."""
    margin: Callable[..., PlacementMargin | None] | PlacementMargin | None = field(
        default=None, compare=False, repr=False
    )
    """The placement margin, or what finds it."""

    @cached_property
    def placement_margin(self) -> PlacementMargin | None:
        """Where the surface may stand; found when first read. None where that is not known."""
        return self.margin() if callable(self.margin) else self.margin

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: the margin as it is found."""
        return {**vars(self), "margin": self.placement_margin}


class _Deferred(NamedTuple):
    make: Callable[[], Any]


deferred: Callable[[Callable[[], Any]], Any] = _Deferred
"""Stand-in for a field of `Verdict` that is made when it is first read."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """The answer for one robot, one set of cells and one task; see `feasibility.check`.

    Fields that take a while to make and that not everyone reads (the graph as networkx, the
    causes) may be given as `deferred`.
    """

    answer: Answer
    evidence: Evidence
    message: str
    """One or two sentences: what was found or tried, at which resolution."""
    robot: Robot
    cells: Cells
    task: Task
    method: str
    """'complete' or 'greedy'."""
    seed: int
    graph: nx.Graph
    """Graph G. Nodes: every flat cell index, with its centre `point` (3,) in m and `normal` (3,),
    its `index` (row, column), `covered`, and `q` (n,) or None where the best component does not
    reach it. Edges: pairs of cells that a motion joins, with `motion` (k, n) from the smaller index
    to the larger. Made when first read; `networkx.write_graphml` takes it."""
    covered: Mask
    """(N,) cells that the best single component visits."""
    causes: tuple[Cause, ...] = ()
    """One for each cell that is not covered, in order of index; found when first read."""
    components: tuple[Ints, ...] = ()
    """Cells of each connected component found, the best first; the greedy search keeps its best
    tree only."""
    postures: Array | None = None
    """(K, n) a configuration of each of `components`, in their order; None where none is kept."""
    tree: nx.DiGraph | None = None
    """Tree T of the paper's search; None for other methods."""
    start: int | None = None
    """Flat index of the cell where the tree (greedy) or the witness (complete) starts."""
    witness: Walk | None = None
    """The covering motion; None unless feasible, and for the greedy search, whose tree enters
    cells without visiting their centres (its `certificate` is of the tree's motions)."""
    certificate: Certificate | None = None
    proof: CutTree | None = None
    """Why no motion covers every cell, to be verified without the search; None unless `evidence` is
    proof."""
    timing: Mapping[str, float] = field(default_factory=dict)
    """Seconds: load_s, search_s, certify_s, total_s."""
    n_edges: int = 0
    """Number of edges of graph G."""
    unchecked_links: tuple[str, ...] = ()
    """Links without any shape, where collisions are checked, and "FLANGE to TCP" where no body is
    between the two."""
    pairs_left_out: tuple[LeftOut, ...] = ()
    """Pairs that are not checked, and why."""
    treated: Any = None
    """What the motion that was found treats, a `demands.area.TreatedArea`; None unless the
    task has a footprint and a motion was accepted. Measured when first read."""
    statistics: Mapping[str, Any] = field(default_factory=dict)
    """Counts of work done (FK evaluations, calls, proofs), for benchmarks and the curious."""

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: everything, deferred fields as what they are when read."""
        return {name: getattr(self, name) for name in vars(self)}

    if not TYPE_CHECKING:  # or it would let any name pass

        def __getattribute__(self, name: str) -> Any:
            """A field; what was `deferred` is made when it is first read, and kept."""
            value = object.__getattribute__(self, name)
            if isinstance(value, _Deferred):
                value = vars(self)[name] = value.make()
            return value

    @property
    def feasible(self) -> bool:
        """True when one continuous motion is known to cover every cell."""
        return self.answer is Answer.FEASIBLE

    @property
    def n_covered(self) -> int:
        """Number of cells that the best single component visits."""
        return int(self.covered.sum())

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        """Table, causes and picture, for notebooks; see `feasibility.reports.notebook`.

        Loaded by its name when a notebook asks: no verdict needs pictures otherwise.
        """
        bundle: dict[str, str] = import_module("feasibility.reports.notebook").mimebundle(self)
        return bundle

    def __repr__(self) -> str:
        """The verdict in one line."""
        pairs = len(self.cells.pairs)
        said = said_of(self.robot, self.task.collision).capitalize()
        return (
            f"{self.answer} ({self.evidence}): {self.n_covered} of {len(self.cells)} cells, "
            f"{self.n_edges} of {pairs} edges. {self.message} {said}."
        )
