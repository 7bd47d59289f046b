"""What a study keeps of one verdict: plain numbers and words, computed where the task runs."""

from __future__ import annotations

import math
import os
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from feasibility.cases import Case, parse_toml, read_robot, read_surface, toml_document
from feasibility.clock import Clock
from feasibility.collisions import gather
from feasibility.division import undominated
from feasibility.studies.placed_cases import HOME, case_of
from feasibility.verdict import CauseKind, Verdict
from robots import flange_axis

if TYPE_CHECKING:
    from feasibility.verdict import Verdict
    from robots import Robot
    from surfaces import Cells
    from surfaces.meshes.cells import MeshCells

EXAMINED = 6  # missed cells whose causes are determined; the others take that of the nearest one


class CauseCounts(NamedTuple):
    """Why the cells of one verdict are missed."""

    cells: dict[str, int]
    """Number of missed cells by cause, the most frequent first."""
    examined: int
    """How many cells were examined for it."""


def cause_counts(verdict: Verdict) -> CauseCounts:
    """Count the missed cells of a verdict by cause.

    Cells that another component covers are disconnected. Of the cells that no component covers,
    `EXAMINED` are examined, and the others count as the nearest of these.
    """
    missed = np.flatnonzero(~verdict.covered)
    if len(missed) == 0:
        return CauseCounts({}, 0)
    if verdict.method == "greedy":
        kinds = [str(cause.kind) for cause in verdict.causes]
        return CauseCounts(_counted(kinds), len(kinds))
    from feasibility.roadmap import Exploration, arrays_of
    from feasibility.roadmap.causes import cause_of
    from feasibility.roadmap.joint_boxes import blockers_of

    reached = np.zeros(len(verdict.cells), dtype=bool)
    for cells in verdict.components:
        reached[cells] = True
    kinds = [str(CauseKind.DISCONNECTED)] * int(reached[missed].sum())
    lost = missed[~reached[missed]]
    if len(lost) == 0:
        return CauseCounts(_counted(kinds), 0)
    # A new exploration: its Newton's method, its random starts, and proofs by the tool are used.
    case = verdict.robot, verdict.cells.surface, verdict.task
    arrays = arrays_of(verdict.robot, verdict.cells, verdict.task)
    blockers, bodies = blockers_of(*case), gather(*case[:2], case[2].collision, case[2].standoff)
    exploration = Exploration(verdict.robot, verdict.cells, arrays, verdict.seed, blockers=blockers)
    pairs = () if bodies is None else bodies.pairs
    few = lost[np.unique(np.linspace(0, len(lost) - 1, EXAMINED).round().astype(np.int64))]
    for cell in few.tolist():
        exploration.tool_collides(cell)
    examined = [cause_of(exploration, cell, pairs) for cell in few.tolist()]
    centres = verdict.cells.centres
    away = np.linalg.norm(centres[lost][:, None] - centres[few][None], axis=2)  # (L, E)
    kinds += [str(examined[int(k)].kind) for k in away.argmin(axis=1)]
    return CauseCounts(_counted(kinds), len(examined))


def _counted(kinds: list[str]) -> dict[str, int]:
    """Causes with their number of cells, the most frequent first."""
    return dict(sorted(Counter(kinds).items(), key=lambda entry: (-entry[1], entry[0])))


ROBOTS_KEPT = 32  # arms that one worker keeps
MESHES_KEPT = 4

Tables = dict[str, Any]
Outcome = dict[str, Any]


def evaluate(tables: Tables) -> Outcome:
    """Decide one case.

    The outcome depends on the tables alone, as long as the search has no time limit; a limit
    counts from here on, for loading and cutting too.

    Args:
        tables: a case, as `Case.to_tables` gives it.

    Returns:
        See `outcome_of`.

    Raises:
        CaseError: the case cannot be used.
    """
    from feasibility.checking import check

    case = case_of(tables)
    clock = clock_of(case)
    return outcome_of(
        check(arm_of(case), cut_of(case), case.built_task(), case.search, clock=clock)
    )


def clock_of(case: Case) -> Clock:
    """The time limit of a case, from now on; kernels are loaded before, like everywhere."""
    return Clock(case.search.time_limit).begin(time.monotonic())


def arm_of(case: Case) -> Robot:
    """The arm of a case, loaded once.

    Raises:
        RobotError: it cannot be loaded so.
    """
    return _load(toml_document({"robot": case.robot.table()}), case.surface.frame)


@lru_cache(maxsize=ROBOTS_KEPT)
def _load(table: str, surface_link: str | None) -> Robot:
    """The arm of a [robot] table, written as a document; a link of it may carry the surface."""
    part = read_robot(parse_toml(table)["robot"], [])
    if part is None:
        raise ValueError("the table of a robot that was read before cannot be read again")
    return part.build(surface_link)


TOOL = ("tcp", "approach_axis", "reference_axis")


def mounted_as(robot: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """The [robot] table of an arm that stands where another one does, unless it says otherwise.

    The base, and the axes that carry it or the surface, belong to the cell, and so does a tool
    whose centre point is given (see `mounting_fault`); limits and locked joints belong to the arm.

    Example:
        >>> mounted_as({"name": "ur5"}, {"name": "panda", "base": {"position": [0, 0, 1]}})
        {'base': {'position': [0, 0, 1]}, 'name': 'ur5'}
    """
    tool = TOOL if given.get("tcp") is not None and "tcp" not in robot else ()
    kept = {key: given[key] for key in ("base", "axis", *tool) if given.get(key) is not None}
    return {**kept, **robot}


def mounting_fault(robot: Mapping[str, Any], given: Mapping[str, Any]) -> str | None:
    """Why the other arm's tool cannot be mounted on this one as it stands; None where it can.

    A tool centre point is given from the tool frame. Where the flanges of the two arms point along
    different axes of that frame, the same numbers would be a tool that points elsewhere.
    """
    if given.get("tcp") is None or "tcp" in robot:
        return None
    ours, theirs = flange_axis(**_named(robot)), flange_axis(**_named(given))
    if ours == theirs:
        return None
    return (
        f"has a tool frame whose flange points along {list(ours)}, that of the case along "
        f"{list(theirs)}, so robot.tcp does not fit it; expected a [robot] table with a tcp of its "
        "own (in a study)"
    )


def _named(table: Mapping[str, Any]) -> dict[str, Any]:
    """What a [robot] table says of which arm it is."""
    return {"name": table.get("name"), "tool_frame": table.get("tool_frame")}


def cut_of(case: Case) -> Cells:
    """The cells of a case; a mesh or STEP faces are read and cut once, and then placed.

    Raises:
        CaseError: there is no such surface, or it cannot be cut so.
    """
    from surfaces import rotation_from_rpy
    from surfaces.meshes.cells import MeshCells

    if case.surface.kind not in ("mesh", "step"):
        return case.surface.cut()
    table = {key: value for key, value in case.surface.table().items() if value is not None}
    file = os.stat(table["file"])
    home = _cut(toml_document({"surface": table | HOME}), file.st_mtime_ns, file.st_size)
    placed = replace(
        home.surface,
        rotation=rotation_from_rpy(*np.radians(case.surface.rpy_deg)),
        position=np.array(case.surface.position),
    )
    return MeshCells.of(placed, home.labels)


@lru_cache(maxsize=MESHES_KEPT)
def _cut(table: str, changed: int, size: int) -> MeshCells:
    """The cells of the mesh of a [surface] table, written as a document."""
    part = read_surface(parse_toml(table)["surface"], [])
    if part is None:
        raise ValueError("the table of a surface that was read before cannot be read again")
    return cast("MeshCells", part.cut())


def outcome_of(verdict: Verdict) -> Outcome:
    """A verdict as JSON values; no timing, so that the same case always has the same outcome.

    Returns:
        verdict, evidence, message: as in `Verdict`; method, seed.
        cells, covered, share: how many, how many the best motion covers, and the share of the area
            (0..1) that it covers.
        edges, pairs: neighbouring cells that a motion joins, and all of them.
        causes: missed cells by cause, the most frequent first; `examined` says how many of them
            were examined, the others counting as the nearest of these.
        components: the sets of cells that single motions cover, none within another, the best
            first, as hexadecimal bits (see `cells_of`).
        margins: what the covering motion leaves (see `margins_of`), None unless feasible.
        certificate: what the replay measured, None unless feasible.
        fk: evaluations of the arm.
    """
    areas = np.asarray(verdict.cells.areas)
    whole = float(areas.sum())
    causes, examined = cause_counts(verdict)
    measured = verdict.certificate
    components = sorted(verdict.components, key=len, reverse=True)
    covers = np.zeros((len(components), len(areas)), dtype=bool)
    for row, cells in zip(covers, components, strict=True):
        row[cells] = True
    return {
        "verdict": str(verdict.answer),
        "evidence": str(verdict.evidence),
        "message": verdict.message,
        "method": verdict.method,
        "seed": int(verdict.seed),
        "cells": len(verdict.cells),
        "covered": verdict.n_covered,
        "share": float(areas[verdict.covered].sum()) / whole if whole > 0.0 else 1.0,
        "edges": int(verdict.n_edges),
        "pairs": len(verdict.cells.pairs),
        "causes": causes,
        "examined": examined,
        "components": [bits_of(cover) for cover in covers[undominated(covers)]],
        "margins": margins_of(verdict),
        "certificate": None
        if measured is None
        else {
            "waypoints": int(measured.waypoints),
            "max_position_error_m": finite(measured.max_position_error),
            "max_angle_deg": finite(math.degrees(measured.max_angle)),
        },
        "fk": int(verdict.statistics.get("fk", 0)),
    }


def merit(outcome: Mapping[str, Any]) -> tuple[bool, float, float]:
    """A key that sorts the best first: feasible, by covered share, by margin to the limits.

    Args:
        outcome: with `verdict`, `share` (absent where the task failed) and `margins`.
    """
    margins = outcome.get("margins") or {}
    limit = margins.get("limit_deg")
    margin = 0.0 if not margins else 360.0 if limit is None else float(limit)
    share = float(outcome.get("share", -1.0))  # unknown is worse than nothing
    return outcome["verdict"] != "feasible", -share, -margin


def margins_of(verdict: Verdict) -> dict[str, float | None] | None:
    """What the covering motion keeps from every bound; None where no motion is certified.

    Returns:
        limit_deg, limit_m: least distance of a turning (a sliding) joint from its limits, None
            where no such joint has one.
        cone_deg: by how much the tool axis stays inside the cone.
        reach_m: by how much the furthest target is nearer than the arm's reach; None without one.
    """
    certificate, robot, task = verdict.certificate, verdict.robot, verdict.task
    if certificate is None or not verdict.feasible or len(verdict.cells) == 0:
        return None
    turning = sliding = math.inf
    if verdict.witness is not None:
        q = verdict.witness.q
        least = np.minimum(q - robot.lower, robot.upper - q).min(axis=0, initial=np.inf)
        turning = math.degrees(float(least[~robot.prismatic].min(initial=np.inf)))
        sliding = float(least[robot.prismatic].min(initial=np.inf))
    points = task.targets(verdict.cells).points
    away = float(robot.distance_from_base(points).max())
    return {
        "limit_deg": finite(turning),
        "limit_m": finite(sliding),
        "cone_deg": task.cone_deg - math.degrees(float(certificate.max_angle)),
        "reach_m": finite(robot.reach - away),
    }


def finite(value: float) -> float | None:
    """JSON has neither inf nor NaN."""
    return float(value) if math.isfinite(value) else None


def bits_of(cover: NDArray[np.bool_]) -> str:
    """Cells (N,) as hexadecimal bits, the first cell first.

    Example:
        >>> bits_of(np.array([True, False, False, True, True]))
        '98'
    """
    return np.packbits(cover).tobytes().hex()


def cells_of(bits: str, n: int) -> NDArray[np.bool_]:
    """(n,) the cells that `bits_of` wrote.

    Example:
        >>> cells_of("98", 5).tolist()
        [True, False, False, True, True]

    Raises:
        ValueError: they are no bits of n cells.
    """
    data = np.frombuffer(bytes.fromhex(bits), dtype=np.uint8)
    if len(data) != (n + 7) // 8:
        raise ValueError(f"{len(data)} bytes do not hold the bits of {n} cells")
    return np.unpackbits(data, count=n).astype(bool)
