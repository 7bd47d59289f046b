"""How many runs it takes at least, proved: whatever the search found or did not find.

Poses 0 .. N - 1 lie along a toolpath, and runs 1 .. R work on it in order: run r on poses
a_r .. b_r, each one continuous motion along the curves between them, with b_r <= a_(r + 1). Call
i < j **parted** if no motion with the tool within tolerance and cone of the curves between poses
i .. j covers all of these. A cut tree for that piece of the toolpath by itself proves it: the part
of a run from over pose i to over pose j is such a motion (`feasibility.cut_tree`). So does a single
pose among them that is proved uncoverable, as a tree of one leaf.

**Lemma.** Let i_1 < j_1 <= i_2 < j_2 <= ... <= i_m < j_m be parted pairs of poses that runs work
on. Then there are at least m + 1 runs, so at least m interruptions.

*Proof.* Let F(p) and L(p) be the first and the last run that passes pose p. No run passes both i_k
and j_k, since it would pass all poses between them; runs are in order, so L(i_k) < F(j_k) <=
L(j_k). And L(j_k) <= L(i_(k+1)): with r = L(j_k), some run s passes i_(k+1); if s < r then
b_s <= a_r <= j_k <= i_(k+1) <= b_s, so a_r = i_(k+1), and run r passes that pose too. Hence
L(i_1) < L(j_1) <= L(i_2) < ... < L(j_m), which are m + 1 runs. QED

The bound is for this order of passes, for the poses that the runs found work on, and for
constraints without speeds. Pairs are looked for one after the other: from pose i to the first
pose that no known motion gets to from there, and further on where that is not proved. Where a gap
is too narrow for a proof the bound is less than what was found, perhaps 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from coverable_arrays import Ints, Mask
from feasibility.certification import verify_proof
from feasibility.clock import OutOfTime
from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.division import prove_apart
from feasibility.roadmap import Exploration, Ruling, arrays_of
from feasibility.runs.fewest import Stations
from feasibility.task import Task
from surfaces.toolpaths import PoseCells

MOST_TRIED = 24  # pieces of a toolpath that a proof is looked for of
FURTHER = (0.0, 0.25, 0.75)  # [1] of the poses up to where the next run would end
MOST_SEEDS = 12  # configurations over one of them
SEEDED = 5  # poses of a piece over which its own search begins


@dataclass(frozen=True, slots=True)
class Parted:
    """A piece of a toolpath that no single motion runs."""

    first: int
    """Its first pose."""
    last: int
    """Its last pose."""
    proof: CutTree
    """For the poses first .. last as a toolpath of their own, numbered from 0."""


@dataclass(eq=False)
class _Pieces:
    """Pieces of a toolpath, and proofs about them."""

    exploration: Exploration
    cells: PoseCells
    task: Task
    worked: Ints
    """The poses that the runs found work on."""
    tried: int = field(default=0)

    def parted(self, first: int, last: int) -> Parted | None:
        """The poses first .. last, or a part of them, proved to be parted; None where nothing is.

        Raises:
            OutOfTime: the deadline passed.
        """
        self.tried += 1
        rulings = self.exploration.rulings
        lost = [k for k in range(first, last + 1) if rulings.get(k) is Ruling.PROVED]
        tree = CutTree(Leaf(lost[0] - first)) if lost else self._cut(first, last)
        return None if tree is None else self.verified(Parted(first, last, tree))

    def verified(self, found: Parted) -> Parted | None:
        """A claim made as narrow as its leaves are, where the verifier accepts it.

        A cut that nothing on the curves of some poses crosses is one that nothing on the curves
        of some of them crosses.

        Raises:
            OutOfTime: the deadline passed.
        """
        leaves = [found.first + leaf.cell for leaf in found.proof.leaves()]
        inside = self.worked[(self.worked >= found.first) & (self.worked <= found.last)]
        before, behind = inside[inside <= min(leaves)], inside[inside >= max(leaves)]
        if not len(before) or not len(behind) or before[-1] == behind[0]:
            return None
        first, last = int(before[-1]), int(behind[0])
        root = _renumbered(found.proof.root, found.first - first)
        tree = CutTree(root, found.proof.opened)
        own = poses_between(self.cells, first, last)
        judged = verify_proof(self.exploration.robot, own, self.task, tree, self._tick)
        return Parted(first, last, tree) if judged.accepted else None

    def _cut(self, first: int, last: int) -> CutTree | None:
        """A cut tree for a piece, guessed from the configurations known over it."""
        known, task, own = self.exploration, self.task, poses_between(self.cells, first, last)
        arrays = arrays_of(known.robot, own, task)
        exploration = Exploration(known.robot, own, arrays, known.seed, known.clock)
        for pose in np.unique(np.linspace(first, last, SEEDED).astype(int)).tolist():
            some = known.roadmap.over[pose][:MOST_SEEDS]
            exploration.add_seeds(pose - first, [known.roadmap.q[node] for node in some])
        if not exploration.reached.all():
            return None
        return prove_apart(exploration, task).proof

    def _tick(self) -> None:
        self.exploration.tick("proving how many runs it takes")


def poses_between(cells: PoseCells, first: int, last: int) -> PoseCells:
    """The poses first .. last of a toolpath as one of their own."""
    surface, some = cells.surface, slice(first, last + 1)
    steps = np.arange(last - first)
    return PoseCells.of(
        replace(
            surface,
            points=surface.points[some],
            outward=surface.outward[some],
            axes=None if surface.axes is None else surface.axes[some],
            along=None if surface.along is None else surface.along[some],
            pairs=np.column_stack([steps, steps + 1]),
            working=None if surface.working is None else surface.working[some],
        )
    )


def parted_pieces(
    exploration: Exploration,
    cells: PoseCells,
    task: Task,
    stations: Stations,
    worked: Mask,
    proof: CutTree | None,
) -> tuple[Parted, ...]:
    """Pieces of a toolpath, one behind the other, none of which a single motion runs.

    Args:
        exploration: a finished search; its clock's time counts.
        cells, task: the toolpath and the task, whose speeds do not count.
        stations: what is known of it.
        worked: (N,) the poses that the runs found work on.
        proof: that no single motion runs the whole toolpath, where there is one: it counts where
            nothing more is proved.
    """
    task = replace(task, speed=None, min_manipulability=None, footprint=None, coverage=None)
    pieces, found = _Pieces(exploration, cells, task, np.flatnonzero(worked)), list[Parted]()
    reach, poses = _reach(stations), pieces.worked.tolist()
    here = poses[0] if poses else len(cells)
    try:
        while pieces.tried < MOST_TRIED and here < len(cells):
            ahead = [pose for pose in poses if pose > reach(here)]
            if not ahead:
                break
            one = _next_parted(pieces, here, ahead, reach)
            found += [] if one is None else [one]
            here = ahead[0] if one is None else one.last
        if not found and proof is not None:
            one = pieces.verified(Parted(0, len(cells) - 1, proof))
            found += [] if one is None else [one]
    except OutOfTime:
        pass  # what was proved until then counts
    return tuple(found)


def _next_parted(
    pieces: _Pieces, here: int, ahead: list[int], reach: Callable[[int], int]
) -> Parted | None:
    """A parted piece that begins at the pose `here` or behind it; None where nothing was proved.

    No known motion leads from it to the poses `ahead`; `reach` is how far motions lead from a pose.
    """
    end = max(reach(ahead[0]), ahead[0])
    near = [pose for pose in ahead if pose <= end]
    for last in dict.fromkeys(near[int(share * (len(near) - 1))] for share in FURTHER):
        found = pieces.parted(here, last)
        if found is not None:
            return found
    return None


def _renumbered(node: Cut | Leaf, by: int) -> Cut | Leaf:
    """The same node about cells whose numbers are larger by `by`."""
    if isinstance(node, Leaf):
        return Leaf(node.cell + by)
    return replace(node, below=_renumbered(node.below, by), above=_renumbered(node.above, by))


def _reach(stations: Stations) -> Callable[[int], int]:
    """The furthest pose that known motions lead to from a pose, never back."""
    over, ends = stations.over, stations.steps[:, :2]
    ends = ends[np.argsort(over[ends[:, 0]], kind="stable")]
    first = np.searchsorted(over[ends[:, 0]], np.arange(stations.number + 1))
    furthest = over.copy()
    for pose in range(stations.number - 1, -1, -1):
        x, y = ends[first[pose] : first[pose + 1]].T
        before = -1
        while len(x) and int(furthest[x].sum()) > before:  # step by step over one pose
            before = int(furthest[x].sum())
            np.maximum.at(furthest, x, furthest[y])
    best = np.arange(stations.number)
    np.maximum.at(best, over, furthest)
    return lambda pose: int(best[pose])
