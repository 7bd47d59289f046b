"""Result files: what was saved comes back exactly, for its own case alone, and is written whole."""

import io
import json
import os
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from bad_input import NET_POINTS, sheet
from jobs import TEXTS, case_named, verdict_named
from mesh_writers import stl_of
from readers import TREE, members, packed

from coverable import Case, Evidence, check, load_case, load_result, save_result, view
from feasibility.cut_tree import CutTree, Leaf
from feasibility.read_files import FileError
from feasibility.results.plain import plain
from feasibility.results.result_file import ResultError
from feasibility.safe_files import write_whole
from feasibility.verdict import Verdict
from feasibility.version import version
from robots.shapes.link_pairs import LeftOut

UR5 = """
robot.name = "ur5"
surface = {{ kind = "{kind}", file = "{file}", side = "outside", cells = {cells}, \
position = [0.4, -0.1, 0.3] }}
task = {{ standoff = 0.02, cone_deg = 30 }}
"""


SAME = (
    "answer", "evidence", "message", "method", "seed", "start", "causes", "task", "certificate",
    "proof", "n_edges", "pairs_left_out", "unchecked_links",
)  # fmt: skip


def same_graph(a: Any, b: Any) -> None:
    assert type(a) is type(b)
    assert list(a.nodes) == list(b.nodes)
    for cell, q in a.nodes(data="q"):
        other = b.nodes[cell]["q"]
        assert other is q if q is None else np.array_equal(q, other)
    ends = [sorted(map(tuple, map(list if g.is_directed() else sorted, g.edges))) for g in (a, b)]
    assert ends[0] == ends[1]
    for i, j, motion in a.edges(data="motion"):
        assert np.array_equal(motion, b.edges[i, j]["motion"])


def again(verdict: Verdict, case: Case, folder: Path) -> Verdict:
    """The verdict out of a file, which holds nothing but numbers and one text."""
    loaded = load_result(save_result(verdict, case, folder / "a.result"))
    assert (loaded.case, loaded.case.name, loaded.version) == (case, case.name, version())
    path = save_result(loaded.verdict, case, folder / "b.result")
    assert path.read_bytes() == (folder / "a.result").read_bytes()
    return loaded.verdict


@pytest.mark.parametrize("name", TEXTS)
def test_a_result_comes_back_exactly(name: str, tmp_path: Path) -> None:
    """One for each kind of answer: a witness, causes, the tree of the paper's search."""
    pairs, odd = (LeftOut("base", "arm", "Never", 0.5),), {"odd": ({2.0}, np.array([np.inf]))}
    before = replace(verdict_named(name), pairs_left_out=pairs)
    before = replace(before, statistics=before.statistics | odd)
    assert (before.witness, before.causes, before.tree)[list(TEXTS).index(name)]
    after = again(before, case_named(name), tmp_path)
    for key in SAME:
        assert getattr(after, key) == getattr(before, key), key
    assert dict(after.timing) == dict(before.timing)
    assert dict(after.statistics) == plain(before.statistics) | {"odd": [[2.0], [None]]}
    for pair in zip(
        (before.covered, before.postures, before.cells.centres, before.robot.lower,
         *before.components),
        (after.covered, after.postures, after.cells.centres, after.robot.lower, *after.components),
        strict=True,
    ):  # fmt: skip
        assert np.array_equal(*pair)
    same_graph(before.graph, after.graph)
    for one, other in ((before.tree, after.tree), (before.witness, after.witness)):
        assert (one is None) == (other is None)
    if before.tree is not None:
        same_graph(before.tree, after.tree)
    if before.witness is not None:
        assert np.array_equal(after.witness.q, before.witness.q)
        assert np.array_equal(after.witness.cell, before.witness.cell)
    assert repr(after) == repr(before)
    for member, data in members("plate").items():
        if member != "meta.json":
            assert np.load(io.BytesIO(data)).dtype in (np.float64, np.int64)


@pytest.mark.parametrize("tree", [
    TREE, CutTree(Leaf(2)), CutTree(Leaf(0), ((1, -0.5), (4, 0.0)))], ids=str)  # fmt: skip
def test_a_proof_comes_back_as_it_was(tree: CutTree, tmp_path: Path) -> None:
    verdict = replace(verdict_named("long plate"), proof=tree, evidence=Evidence.PROOF)
    assert again(verdict, case_named("long plate"), tmp_path).proof == tree


def test_a_verdict_is_kept_beside_its_own_case_alone(tmp_path: Path) -> None:
    for setting in ("task.cone_deg=31", "search.seed=1", "search.method=greedy"):
        other = case_named("plate").with_overrides([setting])
        with pytest.raises(ResultError, match=r"the verdict is not about case 'plate'"):
            save_result(verdict_named("plate"), other, tmp_path / "a.result")
    assert not list(tmp_path.iterdir())


def test_an_earlier_format_and_as_many_members_as_may_be(tmp_path: Path) -> None:
    content = dict(members("plate"))
    meta = {**json.loads(content["meta.json"]), "format_version": 3}
    del meta["has_postures"], content["postures.npy"]
    content["meta.json"] = json.dumps(meta).encode()
    content |= {f"x{k}": b"" for k in range(64 - len(content))}
    (tmp_path / "a.result").write_bytes(packed(content))
    loaded = load_result(tmp_path / "a.result").verdict
    assert loaded.feasible
    assert loaded.postures is None


@pytest.mark.parametrize("slanted", [False, True])
def test_cuts_of_earlier_formats_are_read_along_one_joint_alone(slanted: bool, tmp_path: Path):
    content, file = dict(members("proof")), io.BytesIO()
    weights = np.zeros((5, 6))
    weights[[0, 1], [2, 3]] = 1.0
    weights[1, 0] = 0.5 * slanted
    np.save(file, weights)
    del content["proof_joint.npy"]
    (tmp_path / "a.result").write_bytes(packed(content | {"proof_weights.npy": file.getvalue()}))
    if slanted:
        with pytest.raises(ResultError, match="sums of several joints"):
            load_result(tmp_path / "a.result")
    else:
        assert load_result(tmp_path / "a.result").verdict.proof == TREE


@pytest.mark.parametrize("kind", ["mesh", "bspline"])
def test_a_result_is_not_shown_on_another_surface(kind, tmp_path, monkeypatch):
    """A file that has changed, is gone or another; what another file holds is never said."""
    file = tmp_path / {"mesh": "part.stl", "bspline": "net.json"}[kind]
    cells = "12" if kind == "mesh" else "[3, 4]"
    (tmp_path / "a.toml").write_text(UR5.format(kind=kind, file=file.name, cells=cells))

    def write(change: float) -> None:
        points = np.add(NET_POINTS, [0, 0, change])
        net = json.dumps({"points": points.tolist(), "degree": [2, 2]}).encode()
        file.write_bytes(stl_of(sheet() + change) if kind == "mesh" else net)

    write(0.0)
    case = load_case(tmp_path / "a.toml")
    verdict = check(*case.build())
    monkeypatch.chdir("/")
    assert again(verdict, case, tmp_path).feasible
    saved = tmp_path / "a.result"
    write(1e-4)
    with pytest.raises(ResultError, match=f"{file.name}.*in other places now; run the check"):
        load_result(saved)
    if kind == "mesh":
        file.write_bytes(stl_of(sheet()[:, ::-1]))  # the same, but it looks down
        with pytest.raises(ResultError, match="in other places now"):
            load_result(saved)
    file.unlink()
    with pytest.raises(ResultError, match=r"surface\.file.*no such file"):
        load_result(saved)
    secret = tmp_path / "secret.json"
    secret.write_text('{"password": "tulip"}')
    with zipfile.ZipFile(saved) as zipped:
        content = {name: zipped.read(name) for name in zipped.namelist()}
    for other in ("/dev/zero", "/etc/passwd", "/proc/self/environ", str(secret)):
        meta = content["meta.json"].decode().replace(str(file), other)
        (tmp_path / "bad.result").write_bytes(packed({**content, "meta.json": meta.encode()}))
        with pytest.raises(ResultError, match=r"surface\.file") as caught:
            load_result(tmp_path / "bad.result")
        assert not {"tulip", "root:"} & set(str(caught.value).replace('"', " ").split())


NO_SPACE = Mock(side_effect=OSError(28, "No space left on device"))


def test_saving_is_all_or_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No other thread sees another umask either, and no page is left half written."""
    path, args = tmp_path / "a.result", (verdict_named("plate"), case_named("plate"))
    path.write_bytes(b"what was there")
    monkeypatch.setattr(os, "umask", None)
    monkeypatch.setattr(os, "fsync", NO_SPACE)
    with pytest.raises(ResultError, match=r"a\.result: cannot be written: no space left"):
        save_result(*args, path)
    assert path.read_bytes() == b"what was there"
    monkeypatch.undo()
    save_result(*args, path)
    assert load_result(path).verdict.feasible
    assert [file.name for file in tmp_path.iterdir()] == ["a.result"]
    page, drawn = tmp_path / "page.html", view(args[0])
    assert drawn.save_html(page) == page
    before = page.read_bytes()
    monkeypatch.setattr(os, "replace", NO_SPACE)
    with pytest.raises(FileError, match="cannot be written"):
        drawn.save_html(page)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.result", "page.html"]
    assert page.read_bytes() == before


def test_places_that_cannot_be_written_are_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for path, words in (
        ("/dev/full", "/dev/full: cannot be written: no space left"),
        (tmp_path / "no" / "a.result", "there is no folder"),
        (tmp_path, "is a folder"),
        (tmp_path / "file" / "a.result", "there is no folder"),
        ("/proc/self/a.result", "the folder /proc/self cannot be written to"),
    ):
        with pytest.raises(ResultError, match=words):
            save_result(verdict_named("plate"), case_named("plate"), path)


def test_permissions_links_and_pipes_stay_as_they_were(tmp_path: Path) -> None:
    args = verdict_named("plate"), case_named("plate")
    save_result(*args, tmp_path / "new")
    (tmp_path / "plain").touch()
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "plain").stat().st_mode
    (tmp_path / "plain").chmod(0o640)
    (tmp_path / "link").symlink_to("plain")
    save_result(*args, tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert load_result(tmp_path / "plain").verdict.feasible
    assert (tmp_path / "plain").stat().st_mode & 0o777 == 0o640
    os.mkfifo(tmp_path / "pipe")
    reading = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    data = os.urandom(20_000)  # a pipe holds 64 kB
    write_whole(tmp_path / "pipe", lambda stream: stream.write(data))
    assert os.read(reading, 30_000) == data
    os.close(reading)
    assert (tmp_path / "pipe").is_fifo()
