"""One placement tried: a few Newton starts, a short search, the room that its motion leaves.

Moving the surface moves targets and courses rigidly; how much they bend stays. So a placement is
the same problem with its arrays turned and shifted, and the cells need not be cut again.

What a placement leaves free is told by its margin: the least of three shares, each 1 where there is
all the room there could be, and 0 where there is none.

- limits: over every cell, how far a joint stays from the nearer end of its range, by half the range
- cone: over every cell, how far the tool axis stays inside the rim, by the cone
- reach: how far the furthest target stays inside the reach bound, by the reach

Over each cell that configuration of the covering motion's component counts which leaves most of
limits and cone, after moving over the cell's centre away from both.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from feasibility.explorer import Explorer
from feasibility.fibre import NEWTON_STEPS, RIM_SLACK, roomy, wish_for_room
from feasibility.kernels import kernel, put
from feasibility.newton import LANDING_STEPS, correct, land, linearise
from feasibility.placement_bounds import Reach
from feasibility.placement_region import Array, Pose, moved_cells
from feasibility.problem import (
    HERE,
    NEXT,
    Problem,
    accept,
    copy_slot,
    look_at,
    place,
    problem_of,
)
from feasibility.roadmap import NODES, root_of
from feasibility.search import Search
from feasibility.segment import segment_holds
from feasibility.set_cover import undominated
from feasibility.task import Task
from feasibility.verdict import Answer, CauseKind, Evidence, Verdict
from robots import Robot
from surfaces import Cells

PROBES = 8  # cells that represent the surface, besides the furthest and the nearest
STARTS = 16  # Newton starts at each
PIVOT_SEEDS = 8  # guesses at the middle cell
MORE_CELLS = 4  # cells that nothing has reached, seeded in a short search
STIRS = 6  # of the border of the best component, in a short search
MOST_COVERS = 8  # components that are kept of a placement, the largest
NARROW = 0.1  # [1] of the cone: no axis is led further inside
ROOM_STEPS = np.int64(80)  # over one cell's centre, away from limits and rim
STALE = 8  # of them without gain end it
EXAMINED = 6  # missed cells whose causes are looked for; the others take the nearest one's
MOST_SETTLED = 2  # configurations over one cell that room is looked for from


class Stage(StrEnum):
    """How far a placement was looked into."""

    BOUND = "bound"
    """A target is proved out of reach: no search was run."""
    PROBE = "probe"
    """Newton's method failed at some of a few cells: no search was run."""
    SEARCH = "search"
    """A short search was run."""
    CHECK = "check"
    """The full search was run, and its motion replayed."""
    FAILED = "failed"
    """Nobody came to an end with it; the message says why."""


@dataclass(frozen=True, slots=True)
class Margins:
    """The room that the motion over a placement leaves, as shares 0..1; see the module."""

    limits: float
    cone: float
    reach: float

    @property
    def least(self) -> float:
        """The measure of a placement."""
        return min(self.limits, self.cone, self.reach)


@dataclass(frozen=True, eq=False, slots=True)
class Trial:
    """What is known of one placement."""

    pose: Pose
    stage: Stage
    in_reach: float
    """Share of the area that the reach bound leaves open."""
    probed: float = 0.0
    """Share of the probed cells over which Newton's method found a configuration."""
    share: float = 0.0
    """Share of the area that the best single motion found covers; 0 where none was looked for."""
    margins: Margins | None = None
    """None unless that motion covers every cell."""
    covers: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))
    """(K, N) cells of the largest components found, none inside another, the best first."""
    answer: Answer | None = None
    """What `feasibility.check` says; None where it was not asked."""
    evidence: Evidence | None = None
    message: str = ""
    """Its sentences."""
    causes: Mapping[str, int] = field(default_factory=dict)
    """Missed cells by cause, the most frequent first; only where it was asked for."""
    early: bool = False
    """Whether probes came before its search, and could end it."""
    fk: int = 0
    """Evaluations of the arm."""

    @property
    def feasible(self) -> bool:
        """Has `feasibility.check` found and replayed a covering motion?"""
        return self.answer is Answer.FEASIBLE

    @property
    def margin(self) -> float:
        """The measure; 0 where not every cell is covered."""
        return 0.0 if self.margins is None else self.margins.least

    @property
    def complete(self) -> bool:
        """Does one motion found cover every cell?"""
        return bool(len(self.covers) and self.covers[0].all())

    @property
    def rank(self) -> tuple[float, ...]:
        """Larger is better: covered share, then margin, then what was seen before a search."""
        return (round(self.share, 9), self.margin, self.probed, self.in_reach)


@kernel
def _probe(problem, work, cells, guesses, hits):  # type: ignore[no-untyped-def]
    """Newton at each of some cells, from where the last one ended and from guesses."""
    n = guesses.shape[1]
    q, last, known = np.empty(n), np.empty(n), False
    for k in range(cells.shape[0]):
        hits[k] = 0
        for g in range(-1, guesses.shape[0]):
            if g < 0 and not known:
                continue
            if g < 0:
                put(q, last)
            else:
                put(q, guesses[g])
            if land(problem, work, cells[k], q, LANDING_STEPS):
                put(last, q)
                known = True
                hits[k] = 1
                break


@kernel
def _room_at(problem, work, q, out):  # type: ignore[no-untyped-def]
    """Shares of half range and of cone that q leaves (slot 0 holds it)."""
    out[0] = 1.0
    for j in range(q.shape[0]):
        half = 0.5 * (problem.upper[j] - problem.lower[j])
        if half > 0.0 and half < np.inf:
            out[0] = min(out[0], 1.0 - abs((q[j] - problem.lower[j]) / half - 1.0))
    out[1] = max(0.0, 1.0 - work.error[0, 1] / problem.rim)


@kernel
def _make_room(problem, aimed, work, target, approach, q, best):  # type: ignore[no-untyped-def]
    """Self-motion over one target away from limits and rim (q in place); `best` gets its room.

    As `fibre.settle`, but further: each step leads the axis inwards by a part of its angle, down to
    the cone of `aimed`. Every step is certified.
    """
    n = q.shape[0]
    room = np.empty(2)
    look_at(problem, work, target, approach)
    place(problem, work, HERE, q)
    _room_at(problem, work, q, best)
    size, stale = 0.3, 0
    for _ in range(ROOM_STEPS):
        copy_slot(work)
        linearise(problem, work, NEXT, problem.rim)
        wish_for_room(problem, work, q, size)
        for j in range(n):
            work.trial[j] = q[j]
        slack = RIM_SLACK * size / 0.3
        good = correct(aimed, work, work.trial, slack, work.error[1, 1], NEWTON_STEPS)
        if good:
            position, cone = segment_holds(problem, work, q, work.trial)
            good = position <= 1.0 and cone <= 1.0
        if not good:
            size *= 0.5
            if size < 0.01:
                return
            continue
        for j in range(n):
            q[j] = work.trial[j]
        accept(work)
        _room_at(problem, work, q, room)
        stale += 1
        if min(room[0], room[1]) > min(best[0], best[1]) + 1e-3:
            best[0], best[1], stale = room[0], room[1], 0
        if stale > STALE:
            return


class Placer:
    """Tries placements of one surface for one arm and task."""

    def __init__(self, robot: Robot, cells: Cells, task: Task, search: Search) -> None:
        """Gather what all placements share."""
        self.robot, self.cells, self.task, self.search = robot, cells, task, search
        self.problem = problem_of(robot, cells, task)
        self.reach = Reach.of(robot, cells, task)
        self.probes = _spread_cells(cells)

    def problem_at(self, pose: Pose) -> Problem:
        """The problem with the surface's frame at a pose."""
        here, surface = self.problem, self.cells.surface
        turn = pose.rotation @ surface.rotation.T
        shift = np.array(pose.position) - turn @ surface.position
        targets = np.concatenate(
            [here.targets[..., :3] @ turn.T, here.targets[..., 3:] @ turn.T], axis=2
        )
        targets[:, 0, :3] += shift
        return here._replace(
            points=np.ascontiguousarray(here.points @ turn.T + shift),
            approaches=np.ascontiguousarray(here.approaches @ turn.T),
            targets=np.ascontiguousarray(targets),
        )

    def try_at(self, pose: Pose, early: bool = True) -> Trial:
        """Look into one placement.

        Args:
            pose: where the surface's frame stands.
            early: whether bounds and probes may end it before a search.
        """
        distances = self.reach.distances(pose.values[None])[0]
        in_reach = float(self.reach.share(pose.values[None])[0])
        if early and distances.max() > self.reach.reach + self.reach.tolerance:
            return Trial(pose, Stage.BOUND, in_reach)
        explorer = Explorer(self.robot, self.cells, self.problem_at(pose), self.search.seed)
        probed = self._searched(explorer, distances, early)
        if probed < 1.0:
            fk = int(explorer.work.counts[0])
            return Trial(pose, Stage.PROBE, in_reach, probed, fk=fk)
        return replace(self.trial_of(explorer, pose, in_reach, probed), early=early)

    def _searched(self, explorer: Explorer, distances: Array, early: bool) -> float:
        """Probe and search; returns the share of probed cells that were reached."""
        if early:
            ends = [int(distances.argmax()), int(distances.argmin())]
            some = np.array(list(dict.fromkeys([*ends, *self.probes])), dtype=np.int64)
            hits = np.zeros(len(some), dtype=np.int64)
            guesses = explorer.guesses(STARTS)
            _probe(explorer.problem, explorer.work, some, guesses, hits)
            if not hits.all():
                return float(hits.mean())
        _skim(explorer, early)
        return 1.0

    def replayed(self, trial: Trial, component: int) -> str:
        """Replay the motion behind one of a trial's `covers`, which is found again for that.

        Returns:
            Empty where the independent replay accepts one continuous motion over these cells;
            otherwise why it does not.
        """
        from feasibility.certificate import replay
        from feasibility.complete import explore
        from feasibility.walk import covering_walk

        cells = moved_cells(self.cells, trial.pose)
        if trial.stage is Stage.CHECK:
            problem = problem_of(self.robot, cells, self.task)
            explorer = Explorer(self.robot, cells, problem, self.search.seed)
            explore(explorer)
        else:
            problem = self.problem_at(trial.pose)
            explorer = Explorer(self.robot, self.cells, problem, self.search.seed)
            distances = self.reach.distances(trial.pose.values[None])[0]
            self._searched(explorer, distances, trial.early)
        cover = trial.covers[component]
        for root in explorer.roots():
            if (explorer.covers(root) >= cover).all():
                walk = covering_walk(explorer.roadmap, root)
                told = replay(self.robot, cells, self.task, walk, explorer.covers(root))
                return "" if told.accepted else told.refusal
        return "the search did not find this motion again"

    def check_at(self, pose: Pose, causes: bool = False) -> Trial:
        """Ask `feasibility.check` about one placement.

        Args:
            pose: where the surface's frame stands.
            causes: whether to look for the causes of missed cells.
        """
        from feasibility.checking import check

        cells = moved_cells(self.cells, pose)
        verdict = check(self.robot, cells, self.task, self.search)
        tried = self.try_at(pose, early=False) if verdict.feasible else None
        if tried is not None and not tried.complete:
            tried = self._explored(cells, pose)
        covers = np.zeros((len(verdict.components), len(cells)), dtype=bool)
        for row, component in zip(covers, verdict.components, strict=True):
            row[component] = True
        covers = covers[undominated(covers)][:MOST_COVERS]
        return Trial(
            pose=pose,
            stage=Stage.CHECK,
            in_reach=float(self.reach.share(pose.values[None])[0]),
            probed=1.0 if verdict.feasible else 0.0,
            share=self.share_of(verdict.covered),
            margins=None if tried is None else tried.margins,
            covers=covers,
            answer=verdict.answer,
            evidence=verdict.evidence,
            message=verdict.message,
            causes=_causes(verdict) if causes else {},
            fk=int(verdict.statistics["fk"]) + (0 if tried is None else tried.fk),
        )

    def _explored(self, cells: Cells, pose: Pose) -> Trial:
        """The search of `check` again, for the room that its motion leaves."""
        from feasibility.complete import explore

        problem = problem_of(self.robot, cells, self.task)
        explorer = Explorer(self.robot, cells, problem, self.search.seed)
        explore(explorer)
        return self.trial_of(explorer, pose, 1.0, 1.0)

    def share_of(self, cover: NDArray[np.bool_]) -> float:
        """Share of the area that some cells (N,) have."""
        areas = self.cells.areas
        return 1.0 if cover.all() else float(areas[cover].sum() / areas.sum())

    def trial_of(self, explorer: Explorer, pose: Pose, in_reach: float, probed: float) -> Trial:
        """What a search found."""
        covers = covers_of(explorer)
        margins = self.margins(explorer, pose) if explorer.complete else None
        return Trial(
            pose=pose,
            stage=Stage.SEARCH,
            in_reach=in_reach,
            probed=probed,
            share=self.share_of(covers[0]) if len(covers) else 0.0,
            margins=margins,
            covers=covers,
            fk=int(explorer.work.counts[0]),
        )

    def margins(self, explorer: Explorer, pose: Pose) -> Margins:
        """The room that the component which covers every cell leaves."""
        problem, roadmap, work = explorer.problem, explorer.roadmap, explorer.work
        # Steps over a centre head for a cone that is next to nothing, and keep to the task's.
        aimed = problem._replace(rim=NARROW * problem.rim if problem.rim < np.inf else np.inf)
        room = np.empty(2)
        best = np.full((len(self.cells), 2), -1.0)  # limits and cone, of the roomiest so far
        settled = np.zeros(len(self.cells), dtype=np.int64)
        for x in range(int(roadmap.counters[NODES])):
            cell = int(roadmap.cell[x])
            if root_of(roadmap, roadmap.component[x]) != explorer.best:
                continue
            if settled[cell] == MOST_SETTLED:
                continue
            settled[cell] += 1
            q = roadmap.q[x].copy()
            _make_room(
                problem, aimed, work, problem.points[cell], problem.approaches[cell], q, room
            )
            if room.min() > best[cell].min():
                best[cell] = room
        limits, cone = np.clip(best.min(axis=0), 0.0, 1.0).tolist()
        return Margins(limits, cone, max(0.0, min(1.0, self.reach.slack(pose.values))))


def _causes(verdict: Verdict) -> dict[str, int]:
    """Missed cells by cause; of those that nothing reaches, some are examined."""
    from feasibility.causes import diagnose

    missed = np.flatnonzero(~verdict.covered)
    reached = np.zeros(len(verdict.cells), dtype=bool)
    for component in verdict.components:
        reached[component] = True
    counts: Counter[str] = Counter()
    counts[str(CauseKind.DISCONNECTED)] = int(reached[missed].sum())
    lost = missed[~reached[missed]]
    if len(lost):
        problem = problem_of(verdict.robot, verdict.cells, verdict.task)
        explorer = Explorer(verdict.robot, verdict.cells, problem, verdict.seed)
        few = lost[np.unique(np.linspace(0, len(lost) - 1, EXAMINED).round().astype(np.int64))]
        kinds = [str(diagnose(explorer, int(cell)).kind) for cell in few]
        centres = verdict.cells.centres
        away = np.linalg.norm(centres[lost][:, None] - centres[few][None], axis=2)
        counts.update(kinds[int(k)] for k in away.argmin(axis=1))
    return {kind: count for kind, count in counts.most_common() if count}


def covers_of(explorer: Explorer) -> NDArray[np.bool_]:
    """(K, N) the largest components, none inside another, the best first."""
    roots = [root for root in explorer.roots() if explorer.roadmap.size[root] > 0]
    covers = explorer.roadmap.cover[roots[: 4 * MOST_COVERS]].astype(bool)
    return np.asarray(covers[undominated(covers)][:MOST_COVERS])


def _skim(explorer: Explorer, early: bool) -> None:
    """A short search: the middle cell, some that it leaves unreached, some stirring at borders.

    With `early` it ends at a cell over which nothing is found: no motion will cover that one.
    """
    pivot = explorer.cells.middle
    guesses = explorer.guesses(PIVOT_SEEDS)
    room = roomy(explorer.problem, explorer.work, pivot, guesses)
    for k in np.argsort(-room, kind="stable"):
        if room[k] >= 0.0:
            explorer.plant(pivot, guesses[k : k + 1])
        if explorer.complete:
            return
    for _ in range(MORE_CELLS):
        missed = np.flatnonzero(~explorer.covered)
        lost = missed[~explorer.reached[missed]]
        some = lost if len(lost) else missed
        found = explorer.plant(int(explorer.rng.choice(some)), explorer.guesses(STARTS))
        if explorer.complete or (early and len(lost) and not found):
            return
    for _ in range(STIRS):
        for root in explorer.roots()[:2]:
            border = explorer.border(root)
            if len(border):
                explorer.stir(int(explorer.rng.choice(border)))
            if explorer.complete:
                return


def _spread_cells(cells: Cells) -> list[int]:
    """Some cells that differ most in place and normal, the middle one first."""
    size = float(np.linalg.norm(np.ptp(cells.centres, axis=0))) or 1.0
    features = np.hstack([cells.centres / size, 0.5 * cells.normals])
    chosen = [cells.middle]
    nearest = np.linalg.norm(features - features[chosen[0]], axis=1)
    while len(chosen) < min(PROBES, len(cells)):
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(features - features[chosen[-1]], axis=1))
    return chosen
