"""A division as one JSON object, and as text for people."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from coverable.errors import counted
from feasibility.collisions.asked_bodies import said_of
from feasibility.collisions.words import checked
from feasibility.cut_words import lines as proof_lines
from feasibility.division.division import Apart, Division, SubPatch
from feasibility.division.reconfiguration import Reconfiguration
from feasibility.reports.objects_and_csv import (
    causes_json,
    certificate_json,
    clearance_json,
    proof_json,
)
from feasibility.reports.shortfalls import causes_listed
from feasibility.reports.text_and_tables import (
    clearance_text,
    filled,
    seconds,
    seconds_text,
    summary,
)
from feasibility.results.plain import plain
from feasibility.version import version
from surfaces.cells import Cells

PHASES = {"search_s": "search", "divide_s": "division"}
STATUS = {"complete": 0, "partial": 1, "undecided": 3}
SENTENCES = {
    "complete": "divided: every cell is in a patch that one continuous motion covers.",
    "partial": "divided in part: the patches cover all cells that can be covered.",
    "undecided": "undecided: this division is the best one found, or could not be certified.",
}
PARTLY_FAST = (
    "divided in part: no motion to the other cells is as fast or as far from singularities as "
    "required."
)
NOTHING = "not divided: no cell can be covered."
NOT_FAST = (
    "not divided: no motion was found that is as fast or as far from singularities as required."
)
LACKING = "undecided: every cell is in a patch, but not all that the case demands is shown to hold."


def answer_of(division: Division) -> str:
    """One word: 'complete', 'partial' (cells are left out) or 'undecided'."""
    if not division.decided:
        return "undecided"
    if not division.whole:
        return "partial"
    return "undecided" if division.lacking else "complete"


def as_json(division: Division, before_s: float = 0.0) -> dict[str, Any]:
    """The division as the object that `coverable divide --json` prints.

    Args:
        division: the division.
        before_s: seconds of imports and files before it began; they count as loading.
    """
    cells = division.cells
    return {
        "answer": answer_of(division),
        "cells": len(cells),
        "covered": division.n_covered,
        "ended": division.ended,
        "optimal": division.ended and len(division.patches) <= division.bound,
        "at_least": division.bound,
        "patches": [_patch_json(patch, cells) for patch in division.patches],
        "moves": [_move_json(move, k) for k, move in enumerate(division.moves)],
        "patch_of_cell": division.patch_of(len(cells)).tolist(),
        "proved_at_least": division.at_least,
        "proof": proof_json(division.proof, division.robot, cells),
        "apart": [_apart_json(apart, division) for apart in division.apart],
        "left_out": causes_json(division.left_out, cells),
        "unsettled": [list(cells.unravel(k)) for k in division.unsettled.tolist()],
        "collisions": checked(division.task.collision),
        "lacking": division.lacking,
        "message": division.message,
        "timing": seconds(division.timing, PHASES, before_s),
        "robot": division.robot.name,
        "seed": int(division.seed),
        "version": version(),
    }


def _apart_json(apart: Apart, division: Division) -> dict[str, Any]:
    """Two cells that no motion covers both of, and why."""
    cells = division.cells
    return {
        "cells": [list(cells.unravel(apart.cell)), list(cells.unravel(apart.other))],
        "proof": proof_json(apart.proof, division.robot, cells),
    }


def _patch_json(patch: SubPatch, cells: Cells) -> dict[str, Any]:
    """One patch; values that the replay could not measure are null."""
    return {
        "cells": [list(cells.unravel(k)) for k in patch.cells.tolist()],
        "area_m2": plain(patch.area),
        "pieces": patch.pieces,
        "accepted": patch.accepted,
        "refusal": patch.refusal or None,
        "certificate": {
            **certificate_json(patch.certificate),
            "min_limit_margin": plain(float(patch.certificate.min_limit_margin)),
        },
    }


def _move_json(move: Reconfiguration, k: int) -> dict[str, Any]:
    """The move from patch k to the next: where each joint goes, rad or m."""
    return {
        "from": k,
        "to": k + 1,
        "start": move.start.tolist(),
        "end": move.end.tolist(),
        "waypoints": move.waypoints.tolist(),
        "refusal": move.refusal or None,
        **({} if move.replayed is None else clearance_json(move.replayed)),
        "joints": [
            {"joint": name, **({"by_m": by} if slides else {"by_deg": math.degrees(by)})}
            for name, slides, by in zip(
                move.joint_names, move.prismatic.tolist(), move.moves.tolist(), strict=True
            )
        ],
    }


def as_text(division: Division, title: str, before_s: float = 0.0) -> str:
    """The division for people: the answer, the patches and moves in order, what is left out."""
    answer = answer_of(division)
    head = SENTENCES[answer]
    if division.decided and answer == "undecided":
        head = LACKING
    if answer == "partial":
        fast = division.task.requires_rates
        none, some = (NOT_FAST, PARTLY_FAST) if fast else (NOTHING, head)
        head = some if division.patches else none
    covered = f"{division.n_covered:,} of {len(division.cells):,} cells"
    rows = [
        ("case", title),
        ("covered", f"{covered}, in {_motions(division)}"),
        ("found", division.message),
        ("time", seconds_text(division.timing, PHASES, before_s)),
    ]
    lines = summary(head, rows, said_of(division.robot, division.task.collision))
    if division.patches:
        lines += ["", "In this order:", *_steps(division)]
    if division.proof is not None:
        lines += ["", "Why one motion is not enough:"]
        steps = proof_lines(division.proof, division.robot, division.cells)
        lines += [filled(_indented(line), line.strip()) for line in steps]
    if division.apart:
        lines += ["", filled("", _never_together(division))]
    if division.left_out:
        lines += ["", "Left out:", *causes_listed(division.left_out, division.cells)]
    if len(division.unsettled):
        unsettled = counted(len(division.unsettled), "cell")
        lines += ["", "Not decided:", f"  {unsettled}: the time limit ran out first"]
    return "\n".join(lines)


def _indented(line: str) -> str:
    """The blanks before a line of a proof."""
    return "  " + " " * (len(line) - len(line.lstrip()))


def _never_together(division: Division) -> str:
    """Cells of which a motion covers one at most."""
    cells = sorted({cell for apart in division.apart for cell in (apart.cell, apart.other)})
    named = division.cells.named(cells, len(cells))
    return (
        f"Of the cells {named} no two can be covered by one motion, proved pair by pair "
        "(--json has the proofs)."
    )


def _motions(division: Division) -> str:
    """How many motions, and whether fewer are known to be impossible."""
    number = len(division.patches)
    motions = counted(number, "motion")
    if number > 1 and division.proved_fewest:
        return f"{motions} (no fewer will do, proved)"
    proved = division.optimal or not division.patches
    return motions if proved else f"{motions} (the fewest found)"


def _steps(division: Division) -> Iterator[str]:
    """Patches and the moves between them, a line each."""
    for k, patch in enumerate(division.patches):
        pieces = f", in {patch.pieces} pieces" if patch.pieces > 1 else ""
        replayed = f"refused: {patch.refusal}" if patch.refusal else "accepted by the replay"
        text = (
            f"{counted(len(patch.cells), 'cell')} ({patch.area:.3g} m2{pieces}), around cell "
            f"{_middle(patch, division.cells)}; "
            f"{counted(patch.certificate.waypoints, 'waypoint')}, {replayed}"
        )
        yield filled(f"  {f'patch {k + 1}':<12}", text)
        if k < len(division.moves):
            yield filled(f"  {'move':<12}", _move_text(division.moves[k]))


def _move_text(move: Reconfiguration) -> str:
    """Where the joints go, along which path, and how near bodies come; or why it is refused."""
    parts = [move.described()]
    if len(move.via):
        parts.append(f"through {counted(len(move.via), 'configuration')} (--json has them)")
    if move.refusal:
        parts.append(f"refused: {move.refusal}")
    elif move.replayed is not None:
        parts.append(clearance_text(move.replayed))
    return "; ".join(part for part in parts if part)


def _middle(patch: SubPatch, cells: Cells) -> list[int]:
    """The cell of a patch that is nearest to the mean of all."""
    centres = cells.centres[patch.cells]
    away = np.linalg.norm(centres - centres.mean(axis=0), axis=1)
    return list(cells.unravel(int(patch.cells[np.argmin(away)])))
