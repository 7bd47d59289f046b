"""Result files: a verdict with its case in one file that loads again, without pickles.

The file is a zip of .npy arrays and one `meta.json`, see `archive`. The robot and the cells are not
stored: they are built again from the case, and compared with numbers in the file, so that a result
is never shown on another arm or surface than the ones it was found for.
"""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from coverable.arrays import Array
from coverable.errors import CoverableError, shown
from feasibility.cases.case import Case, Setup
from feasibility.cases.table_reader import CaseError
from feasibility.read_files import FileError
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
from feasibility.verdict import (
    Answer,
    Certificate,
    Evidence,
    PlacementMargin,
    Verdict,
    Walk,
    deferred,
)
from feasibility.version import version

if TYPE_CHECKING:
    from feasibility.demands.area import TreatedArea
    from feasibility.task import Task
    from robots.robot import Robot
    from surfaces.cells import Cells

FORMAT = "coverable-result"
FORMAT_VERSION = 5  # 4 had weights of all joints in each cut of a proof
OLDEST = 3  # states task, method and seed a second time, which is not read
SAID = {
    Answer.FEASIBLE: (Evidence.WITNESS,),
    Answer.INFEASIBLE: (Evidence.PROOF, Evidence.EXHAUSTED),
    Answer.UNDECIDED: (Evidence.BUDGET,),
}
"""What each answer may rest on."""


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
        ResultError: the file cannot be written, or the verdict is about another task or search:
            a file states its case once, and all that is read of it comes from there.

    Returns:
        The path.
    """
    _check_about(verdict, case)
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
        "answer": str(verdict.answer),
        "evidence": str(verdict.evidence),
        "message": verdict.message,
        "start": None if verdict.start is None else int(verdict.start),
        "causes": [cause_row(cause) for cause in verdict.causes],
        "certificate": _certificate_row(verdict.certificate),
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
        arrays |= pack_proof(verdict.proof)
    if verdict.postures is not None:
        arrays["postures"] = verdict.postures
    try:
        write_archive(Path(path), meta, arrays)
    except FileError as error:
        raise ResultError(str(error)) from error
    return Path(path)


def _check_about(verdict: Verdict, case: Case) -> None:
    """Refuse a verdict that is about something else than a case.

    Raises:
        ResultError: its task, method or seed is another.
    """
    search = case.search
    about = replace(verdict.task, collision=None), verdict.method, verdict.seed
    if about != (case.task, search.method, search.seed):
        asked = f"{case.task}, {search.method}, seed {search.seed}"
        raise ResultError(
            f"the verdict is not about case {case.name!r}: it is about {', '.join(map(str, about))}"
            f", and the case asks for {asked}; save it with the case that was checked"
        )


def load_result(path: str | os.PathLike[str]) -> Result:
    """Read a result file; nothing in it is trusted.

    Args:
        path: a file written by `save_result`.

    Raises:
        ResultError: it is no such file, is damaged, is of a newer format, or its robot or
            surface is not available here as it was.
    """
    archive, fields, case = _opened(path)
    try:
        written = fields.text("version")
        setup = case.build()
        check_robot(setup.robot, fields.table("robot"), archive)
        check_cells(setup.cells, case.surface.label, archive)
        verdict = _verdict(fields, archive, setup)
    except CaseError as error:
        raise _unusable(path, error) from error
    except ArchiveError as error:
        raise ResultError(str(error)) from error
    return Result(case, verdict, written)


def case_of_result(path: str | os.PathLike[str]) -> Case:
    """The case that a result file is about; neither arm nor surface is loaded.

    Raises:
        ResultError: it is no such file, or its case is none.
    """
    return _opened(path)[2]


def _opened(path: str | os.PathLike[str]) -> tuple[Archive, Fields, Case]:
    """A result file, its JSON, and its case.

    Raises:
        ResultError: it is no such file, or its case is none.
    """
    try:
        archive = Archive(Path(path), "a result file of `coverable check --save`")
        fields = Fields(archive, archive.meta(), "")
        _check_format(fields)
        text = fields.table("case")
        name = text.text("name")
        case = Case.from_toml(text.text("toml"), name=f"{archive.name}: case {shown(name)}")
        return archive, fields, replace(case, name=name, description=text.text("description"))
    except CaseError as error:
        raise _unusable(path, error) from error
    except ArchiveError as error:
        raise ResultError(str(error)) from error


def _unusable(path: str | os.PathLike[str], error: CaseError) -> ResultError:
    """That a file's case cannot be used, and why."""
    return ResultError(f"{os.fspath(path)!r}: its case cannot be used: {error}")


def _check_format(fields: Fields) -> None:
    """Refuse files of something else, or of another version of the format."""
    if fields.entries.get("format") != FORMAT:
        raise fields.archive.error("is not a result file of `coverable check --save`")
    found = fields.get("format_version", int, "a whole number")
    if not OLDEST <= found <= FORMAT_VERSION:
        raise fields.archive.error(
            f"is of format {found}, written by coverable {shown(fields.entries.get('version'))}; "
            f"coverable {version()} reads formats {OLDEST} to {FORMAT_VERSION}"
        )


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
    proof = unpack_proof(archive, count, n) if fields.flag("has_proof") else None
    components = unpack_ragged(archive, "components", count)
    start = None if fields.entries.get("start") is None else fields.cell("start", count)
    timing = fields.table("timing")
    answer, evidence = fields.member("answer", Answer), fields.member("evidence", Evidence)
    if evidence not in SAID[answer]:
        raise archive.error(f"meta.json: it answers {answer} with the evidence {evidence}")
    task, search = setup.task, setup.search
    return Verdict(
        answer=answer,
        evidence=evidence,
        message=fields.text("message"),
        robot=robot,
        cells=cells,
        task=task,
        method=search.method,
        seed=search.seed,
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
        certificate=_with_margin(read_certificate(fields), robot, cells, task, witness),
        proof=proof,
        unchecked_links=read_names(fields, "unchecked_links"),
        pairs_left_out=read_left_out(fields),
        treated=None
        if witness is None
        else deferred(lambda: _treated(robot, cells, task, witness)),
        timing={key: timing.number(key) for key in timing.entries},
        statistics=dict(fields.table("statistics").entries),
    )


def _certificate_row(certificate: Certificate | None) -> dict[str, Any] | None:
    """The certificate as JSON holds it, but for the margin, which the motion tells."""
    if certificate is None:
        return None
    return {key: value for key, value in plain(asdict(certificate)).items() if key != "margin"}


def _with_margin(
    certificate: Certificate | None, robot: Robot, cells: Cells, task: Task, witness: Walk | None
) -> Certificate | None:
    """The certificate, with a placement margin that is found of the motion when it is read."""
    if certificate is None or witness is None:
        return certificate

    def found() -> PlacementMargin | None:
        from feasibility.certification.motion_replay import replay

        needed = np.ones(len(cells), dtype=bool)
        return replay(robot, cells, task, witness, needed).certificate.placement_margin

    return replace(certificate, margin=found)


def _postures(fields: Fields, archive: Archive, count: int, n: int) -> Array | None:
    """A configuration of each component; files of earlier versions hold none."""
    if not ("has_postures" in fields.entries and fields.flag("has_postures")):
        return None
    return archive.array("postures", np.float64, (count, n))


def _treated(robot: Robot, cells: Cells, task: Task, witness: Walk) -> TreatedArea | None:
    """What the motion treats; what measures it is imported only then."""
    from feasibility.demands.area import treated_by_walk

    return treated_by_walk(robot, cells, task, witness)
