"""Result files: a verdict with its case in one file that loads again, without pickles.

The file is a zip of .npy arrays and one `meta.json`, see `archive`. The robot and the cells are not
stored: they are built again from the case, and compared with numbers in the file, so that a result
is never shown on another arm or surface than the ones it was found for.
"""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from coverable_arrays import Array
from coverable_errors import ArgumentError, CoverableError, shown, worded
from feasibility.cases import CLOSED_FORM_KINDS, Case, CaseError, Setup
from feasibility.results.archive import Archive, ArchiveError, Fields, write_archive
from feasibility.results.proof_arrays import pack_proof, unpack_proof
from feasibility.results.result_arrays import (
    check_cells,
    check_robot,
    pack_graph,
    places,
    probes,
    ragged,
    read_cells,
    unpack_graph,
    unpack_ragged,
)
from feasibility.results.result_rows import (
    cause_row,
    plain,
    read_causes,
    read_certificate,
    read_left_out,
    read_names,
)
from feasibility.safe_files import FileError
from feasibility.task import Task
from feasibility.verdict import (
    Answer,
    Evidence,
    Verdict,
    Walk,
    deferred,
)
from feasibility.version import version

if TYPE_CHECKING:
    from feasibility.treated import TreatedArea
    from robots import Robot
    from surfaces import Cells

FORMAT = "coverable-result"
TASK = ("standoff", "cone_deg", "tolerance")  # what is stored of it; the rest is the case's
FORMAT_VERSION = 3  # 2 had no proofs; 1 no `places`, and the kinds `CLOSED_FORM_KINDS` alone


class ResultError(CoverableError):
    """A result file that cannot be written or read: which one, why, and what would do."""


@dataclass(frozen=True, eq=False, slots=True)
class Result:
    """What a result file holds."""

    case: Case
    verdict: Verdict
    version: str
    """Of coverable, when the file was written."""


def save_result(verdict: Verdict, case: Case, path: str | os.PathLike[str]) -> Path:
    """Write a verdict and its case to one file, whole or not at all.

    Args:
        verdict: what was said about `case`.
        case: the question.
        path: the file; what it held before is replaced once the new content is complete.

    Raises:
        ResultError: the file cannot be written.

    Returns:
        The path.
    """
    n = verdict.robot.n
    meta = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "version": version(),
        "case": {"name": case.name, "description": case.description, "toml": case.to_toml()},
        "robot": {
            "name": verdict.robot.name,
            "tool_frame": verdict.robot.tool_frame,
            "joints": list(verdict.robot.joint_names),
        },
        "task": {key: getattr(verdict.task, key) for key in TASK},
        "answer": str(verdict.answer),
        "evidence": str(verdict.evidence),
        "message": verdict.message,
        "method": verdict.method,
        "seed": int(verdict.seed),
        "start": None if verdict.start is None else int(verdict.start),
        "causes": [cause_row(cause) for cause in verdict.causes],
        "certificate": None if verdict.certificate is None else plain(asdict(verdict.certificate)),
        "unchecked_links": list(verdict.unchecked_links),
        "pairs_left_out": [plain(asdict(pair)) for pair in verdict.pairs_left_out],
        "timing": plain(verdict.timing),
        "statistics": plain(verdict.statistics),
        "has_tree": verdict.tree is not None,
        "has_witness": verdict.witness is not None,
        "has_proof": verdict.proof is not None,
        "has_postures": verdict.postures is not None,
    }
    arrays = {
        "probes": probes(verdict.robot),
        "places": places(verdict.cells),
        "covered": np.flatnonzero(verdict.covered),
        **ragged("components", verdict.components),
        **pack_graph("graph", verdict.graph, n),
    }
    if verdict.tree is not None:
        arrays |= pack_graph("tree", verdict.tree, n)
    if verdict.witness is not None:
        arrays |= {"witness_q": verdict.witness.q, "witness_cell": verdict.witness.cell}
    if verdict.proof is not None:
        arrays |= pack_proof(verdict.proof, n)
    if verdict.postures is not None:
        arrays["postures"] = verdict.postures
    try:
        write_archive(Path(path), meta, arrays)
    except FileError as error:
        raise ResultError(str(error)) from error
    return Path(path)


def load_result(path: str | os.PathLike[str]) -> Result:
    """Read a result file; nothing in it is trusted.

    Args:
        path: a file written by `save_result`.

    Raises:
        ResultError: it is no such file, is damaged, is of a newer format, or its robot or
            surface is not available here as it was.
    """
    try:
        archive = Archive(Path(path), "a result file of `coverable check --save`")
        fields = Fields(archive, archive.meta(), "")
        found = _format(fields)
        written = fields.text("version")
        text = fields.table("case")
        name = text.text("name")
        case = Case.from_toml(text.text("toml"), name=f"{archive.name}: case {shown(name)}")
        case = replace(case, name=name, description=text.text("description"))
        setup = case.build()
        check_robot(setup.robot, fields.table("robot"), archive)
        if found > 1 or case.surface.kind not in CLOSED_FORM_KINDS:
            check_cells(setup.cells, case.surface.label, archive)
        verdict = _verdict(fields, archive, setup)
    except CaseError as error:
        raise ResultError(f"{os.fspath(path)!r}: its case cannot be used: {error}") from error
    except ArchiveError as error:
        raise ResultError(str(error)) from error
    return Result(case, verdict, written)


def _format(fields: Fields) -> int:
    """The version of the format; files of something else, or of a later coverable, are refused."""
    if fields.entries.get("format") != FORMAT:
        raise fields.archive.error("is not a result file of `coverable check --save`")
    found = fields.get("format_version", int, "a whole number")
    if not 1 <= found <= FORMAT_VERSION:
        raise fields.archive.error(
            f"is of format {found}, written by coverable {shown(fields.entries.get('version'))}; "
            f"coverable {version()} reads formats 1 to {FORMAT_VERSION}"
        )
    return int(found)


def _verdict(fields: Fields, archive: Archive, setup: Setup) -> Verdict:
    """The verdict, every index and number checked."""
    from feasibility.cell_graph import cell_graph

    robot, cells = setup.robot, setup.cells
    count, n = len(cells), robot.n
    covered = np.zeros(count, dtype=bool)
    covered[read_cells(archive, "covered", count)] = True
    graph = cell_graph(cells, covered)
    graph.update(unpack_graph(archive, "graph", count, n))
    witness = None
    if fields.flag("has_witness"):
        q = archive.array("witness_q", np.float64, (None, n))
        witness = Walk(q=q, cell=read_cells(archive, "witness_cell", count, (len(q),), low=-1))
    proof = None  # a file of format 2 says nothing of it
    if "has_proof" in fields.entries and fields.flag("has_proof"):
        proof = unpack_proof(archive, count, n)
    components = unpack_ragged(archive, "components", count)
    start = None if fields.entries.get("start") is None else fields.cell("start", count)
    timing = fields.table("timing")
    task = _task(fields.table("task"), setup.task)
    return Verdict(
        answer=fields.member("answer", Answer),
        evidence=fields.member("evidence", Evidence),
        message=fields.text("message"),
        robot=robot,
        cells=cells,
        task=task,
        method=fields.text("method"),
        seed=int(fields.get("seed", int, "a whole number")),
        graph=graph,
        n_edges=graph.number_of_edges(),
        covered=covered,
        causes=read_causes(fields, count),
        components=components,
        postures=_postures(fields, archive, len(components), n),
        tree=unpack_graph(archive, "tree", count, n, tree=True)
        if fields.flag("has_tree")
        else None,
        start=start,
        witness=witness,
        certificate=read_certificate(fields),
        proof=proof,
        unchecked_links=read_names(fields, "unchecked_links"),
        pairs_left_out=read_left_out(fields),
        treated=None
        if witness is None
        else deferred(lambda: _treated(robot, cells, task, witness)),
        timing={key: timing.number(key) for key in timing.entries},
        statistics=dict(fields.table("statistics").entries),
    )


def _postures(fields: Fields, archive: Archive, count: int, n: int) -> Array | None:
    """A configuration of each component; files of earlier versions hold none."""
    if not ("has_postures" in fields.entries and fields.flag("has_postures")):
        return None
    return archive.array("postures", np.float64, (count, n))


def _task(fields: Fields, task: Task) -> Task:
    """The case's task with the numbers that were used: a method may choose the tolerance."""
    standoff, cone_deg = fields.number("standoff"), fields.number("cone_deg")
    tolerance = None if fields.entries.get("tolerance") is None else fields.number("tolerance")
    try:
        return replace(task, standoff=standoff, cone_deg=cone_deg, tolerance=tolerance)
    except ArgumentError as error:
        text = "; ".join(worded(fault.renamed({}, "task")) for fault in error.faults)
        raise fields.archive.error(f"meta.json: {text}") from error


def _treated(robot: Robot, cells: Cells, task: Task, witness: Walk) -> TreatedArea | None:
    """What the motion treats; what measures it is imported only then."""
    from feasibility.treated import treated_by_walk

    return treated_by_walk(robot, cells, task, witness)
