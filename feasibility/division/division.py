"""The answer to "how many motions, then?": patches, their walks, and the moves between them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from coverable.arrays import Ints, Protected
from coverable.errors import counted
from feasibility.collisions.asked_bodies import said_of
from feasibility.cut_tree import CutTree
from feasibility.division.reconfiguration import Reconfiguration
from feasibility.task import Task
from feasibility.verdict import Cause, Certificate, Walk
from robots.robot import Robot
from surfaces.cells import Cells


@dataclass(frozen=True, eq=False, slots=True)
class SubPatch(Protected):
    """Cells that one continuous motion covers, and that motion."""

    cells: Ints
    """(k,) flat indices, sorted."""
    area: float
    """m^2."""
    pieces: int
    """Connected pieces of the surface that the cells make; the motion leads from one to the next
    over cells of other patches."""
    walk: Walk
    """One continuous motion over these cells; it may cross other cells."""
    certificate: Certificate
    """What the independent replay measured along the walk."""
    refusal: str
    """Why the replay refuses the walk; empty when it is accepted."""

    @property
    def accepted(self) -> bool:
        """True when the replay accepts the walk: constraints everywhere, every cell visited."""
        return not self.refusal


@dataclass(frozen=True, eq=False, slots=True)
class Plan:
    """Patches in the order in which they are worked on, and the moves from one to the next."""

    patches: tuple[SubPatch, ...]
    moves: tuple[Reconfiguration, ...]
    """From the end of each patch's walk to the start of the next one's; one fewer than patches.
    Where collisions are checked, they keep clear, or say that no such move was found."""
    bound: int
    """The components that the search found cannot be shared out in fewer patches."""

    @property
    def accepted(self) -> bool:
        """Are all walks accepted by the replay?"""
        return all(patch.accepted for patch in self.patches)

    def patch_of(self, n: int) -> Ints:
        """(n,) index of the patch that each of n cells is in; -1 for cells left out."""
        result = np.full(n, -1, dtype=np.int64)
        for k, patch in enumerate(self.patches):
            result[patch.cells] = k
        return result


@dataclass(frozen=True, eq=False, slots=True)
class Apart:
    """Two cells that no single motion covers."""

    cell: int
    other: int
    proof: CutTree
    """Its leaves are these two cells."""


@dataclass(frozen=True, eq=False, slots=True)
class Division(Plan, Protected):
    """A surface divided into the fewest patches; see `feasibility.division.divide`."""

    robot: Robot
    cells: Cells
    task: Task
    seed: int
    left_out: tuple[Cause, ...]
    """Cells that are in no patch, in order of index, and why."""
    unsettled: Ints
    """Cells that are in no patch because the time limit ran out before they were decided."""
    ended: bool
    """Did the search run to its end, free to move everywhere? Otherwise the patches are the fewest
    known: a time limit struck, or no motion can be certified over a part of the surface."""
    message: str
    """What was found, and on what it rests."""
    at_least: int = 0
    """Motions that it takes at least to cover the cells of the patches, proved: no matter what the
    search found."""
    proof: CutTree | None = None
    """No single motion covers the cells of the patches; None where that is not proved."""
    apart: tuple[Apart, ...] = ()
    """Where more than two motions are proved to be needed: the pairs among `at_least` cells, of
    which a motion covers one at most."""
    lacking: str = ""
    """What the case demands that the motions do not hold together, such as a coverage, or that was
    not judged; empty where they hold all."""
    timing: Mapping[str, float] = field(default_factory=dict)
    """Seconds: load_s, search_s, divide_s, total_s."""

    @property
    def optimal(self) -> bool:
        """Fewest of all that the search can find: it ended, and the optimum is proved."""
        return (self.ended and len(self.patches) <= self.bound) or self.proved_fewest

    @property
    def proved_fewest(self) -> bool:
        """Is it proved that no fewer motions will do, whatever the search found?"""
        return 0 < len(self.patches) <= self.at_least

    @property
    def decided(self) -> bool:
        """Did the search end, and is every walk accepted by the replay?"""
        return self.ended and self.accepted

    @property
    def n_covered(self) -> int:
        """Number of cells that are in a patch whose walk is accepted."""
        return sum(len(patch.cells) for patch in self.patches if patch.accepted)

    @property
    def whole(self) -> bool:
        """Is every cell in a patch whose walk is accepted?"""
        return self.n_covered == len(self.cells)

    def __repr__(self) -> str:
        """The division in one line."""
        patches = counted(len(self.patches), "patch", "patches")
        return (
            f"{patches}, {self.n_covered} of {len(self.cells)} cells. {self.message} "
            f"{said_of(self.robot, self.task.collision).capitalize()}."
        )
