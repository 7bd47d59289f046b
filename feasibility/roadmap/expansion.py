"""How the roadmap grows: seeds, spreading over the surface, closing pairs; see `connecting`, too.

The motions are those of `feasibility.roadmap.motions`, compiled and certified; here is which of
them are tried, and what comes of them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.roadmap.graph import Blocked, Roadmap
from feasibility.roadmap.motions.aiming import look_at
from feasibility.roadmap.motions.off_target import project_near_cell
from feasibility.roadmap.motions.projection import PROJECTION_STEPS
from feasibility.roadmap.motions.search_arrays import SearchArrays
from feasibility.roadmap.motions.self_motion import SETTLE_STEPS, connect, effects, settle
from feasibility.roadmap.motions.tracking import track
from feasibility.roadmap.motions.working_memory import Work

MOST_FAILURES = 12  # failed connections after which a pair of components is left alone
MOST_RIVALS = 6  # other components that a new configuration tries to join, the nearest first
UNTRIED, JOINED, APART = range(3)
"""Of a pair of neighbouring cells: no motion was looked for, there is one, none was found."""


@dataclass(frozen=True)
class Grower:
    """Adds to a roadmap what certified motions reach."""

    arrays: SearchArrays
    work: Work
    roadmap: Roadmap
    tick: Callable[[str], None]
    """Called with what is being done, again and again; what it raises ends that."""

    def track(self, curve: int, ends: tuple[float, float], q: Array) -> Array | None:
        """The motion of `motions.track` from one parameter of a curve to another."""
        return track(self.arrays, self.work, curve, ends, q)[0]

    def connect(self, cell: int, q: Array, goal: Array) -> tuple[Array, bool]:
        """The self-motion of `motions.connect` over a cell's centre."""
        look_at(self.arrays, self.work, cell)
        return connect(self.arrays, self.work, q, goal)

    def add_node(self, cell: int, q: Array, root: int) -> int:
        """Add a node to a root component, and queue it; returns its number."""
        effect = np.empty(len(q))
        effects(self.arrays, self.work, q, effect)
        return self.roadmap.add_node(cell, q.copy(), effect, root)

    def join(
        self, cell: int, q: Array, own: int | None = None, most: int = MOST_FAILURES
    ) -> tuple[int, Array] | None:
        """Try to reach, by self-motion from q over a cell, a node of another component.

        Args:
            cell, q: where the self-motion begins.
            own: the root component of q, None where it has none yet.
            most: failed connections with `own` after which another component is left alone.

        Returns:
            The node and the motion (k, n) to it, q left out; None where none is reached.
        """
        roadmap, passed = self.roadmap, set[int]()
        if own is not None:
            failures = roadmap.failures[own]
            passed = {own, *(other for other, count in failures.items() if count >= most)}
        for _ in range(MOST_RIVALS):
            node = roadmap.nearest(cell, q, passed)
            if node is None:
                break
            rival = roadmap.root_of(node)
            passed.add(rival)
            motion, reached = self.connect(cell, q, roadmap.q[node])
            if reached:
                return node, motion
            if own is not None:
                roadmap.count_failure(own, rival)
        return None

    def seed(self, cell: int, guess: Array) -> bool:
        """Project a guess (n,) onto the constraints over a cell; False where that fails.

        The configuration becomes a component of its own, unless it collides, however it is moved,
        or a self-motion joins it to a node that is there.
        """
        q = guess.copy()
        if not project_near_cell(self.arrays, self.work, cell, q, PROJECTION_STEPS):
            return False
        if self._clear(cell, q):
            settle(self.arrays, self.work, cell, q, SETTLE_STEPS)
            if self.join(cell, q) is None:
                self.add_node(cell, q, self.roadmap.add_component())
        return True

    def _clear(self, cell: int, q: Array) -> bool:
        """Is q (n,) clear of collisions, or could it be moved clear of them, in place?"""
        if not len(self.arrays.collisions):
            return True
        from feasibility.roadmap.moving_clear import moved_clear

        return bool(moved_clear(self.arrays, self.work, cell, q))

    def spread(
        self, neighbours: Sequence[Sequence[tuple[int, int]]], enough: Callable[[int], bool]
    ) -> bool:
        """Spread every queued node into the neighbouring cells that its component misses.

        Args:
            neighbours: of each cell: a cell beside it, and the curve between the two.
            enough: of a root component that has grown: is it all that is wanted?

        Returns:
            True when a component is enough; nodes may be left in the queue then.
        """
        roadmap = self.roadmap
        while roadmap.queue:
            x = roadmap.queue[0]
            cell, q = roadmap.cell[x], roadmap.q[x]
            for target, curve in neighbours[cell]:
                own = roadmap.root_of(x)
                if roadmap.cover[own][target]:
                    continue
                self.tick("spreading over the surface")
                motion = self.track(curve, (0.0, 1.0) if cell < target else (1.0, 0.0), q)
                if motion is None:
                    self._note_blocked(target, own)
                    continue
                joined = self.join(target, motion[-1], own)
                if joined is None:
                    roadmap.add_edge(x, self.add_node(target, motion[-1], own), motion)
                else:
                    own = roadmap.add_edge(x, joined[0], np.concatenate([motion, joined[1]]))
                if enough(own):
                    return True
            roadmap.queue.popleft()
        return False

    def _note_blocked(self, cell: int, own: int) -> None:
        """Keep why the last motion, of a root component into a cell, stopped."""
        roadmap = self.roadmap
        former = roadmap.blocked.get(cell)
        if former is None or roadmap.size[own] >= roadmap.size[roadmap.root(former.component)]:
            code, joint = self.work.stop_reason.tolist()
            roadmap.blocked[cell] = Blocked(code, joint, own)

    def close_pairs(self, pairs: Ints, state: Ints, root: int) -> None:
        """Connect every two neighbouring cells inside one component by a motion of their own.

        Args:
            pairs: (M, 2) the cells, one pair for each curve.
            state: (M,) of each pair, see UNTRIED; only those are tried. Filled here.
            root: the root component.
        """
        for curve in np.flatnonzero(state == UNTRIED).tolist():
            self.tick("joining neighbouring cells")
            state[curve] = JOINED if self._close(curve, pairs[curve].tolist(), root) else APART

    def _close(self, curve: int, pair: Sequence[int], root: int) -> bool:
        """Look for a motion between the nodes over two cells that are nearest to each other.

        Either way, first heading for the other node, then freely. One that cannot be connected to
        the other node may end in a new one.
        """
        roadmap, nodes = self.roadmap, self.roadmap.nearest_two(pair, root)
        if nodes is None:
            return False
        there, back = (*nodes, (0.0, 1.0)), (*nodes[::-1], (1.0, 0.0))
        motion = None
        for (a, b, ends), heading in ((there, True), (back, True), (there, False), (back, False)):
            q, goal, cell = roadmap.q[a], roadmap.q[b], roadmap.cell[b]
            motion, reached = track(self.arrays, self.work, curve, ends, q, goal, heading, cell)
            if motion is not None and reached:
                roadmap.add_edge(a, b, motion)
                return True
        if motion is None:
            return False
        roadmap.add_edge(a, self.add_node(roadmap.cell[b], motion[-1], root), motion)
        return True
