"""Result files: what was saved comes back exactly, and a damaged file is refused with a message."""

import io
import json
import os
import pickle
import random
import zipfile
from dataclasses import fields, replace

import numpy as np
import pytest
from small_cases import TEXTS, small_case, small_verdict

from feasibility.cases import Case
from feasibility.results import archive, load_result, save_result
from feasibility.results import result_file as result
from feasibility.results.result_file import ResultError
from feasibility.safe_files import FileError
from feasibility.viewer import view


def same_graph(a, b):
    assert type(a) is type(b)
    assert list(a.nodes) == list(b.nodes)
    for cell, q in a.nodes(data="q"):
        assert (
            np.array_equal(q, b.nodes[cell]["q"]) if q is not None else b.nodes[cell]["q"] is None
        )
    pairs = a.edges if a.is_directed() else [tuple(sorted(pair)) for pair in a.edges]
    assert sorted(pairs) == sorted(b.edges if b.is_directed() else map(tuple, map(sorted, b.edges)))
    for i, j, motion in a.edges(data="motion"):
        assert np.array_equal(motion, b.edges[i, j]["motion"])


@pytest.fixture(scope="module", params=TEXTS)
def saved(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("results") / "a.result"
    name = request.param
    assert save_result(small_verdict(name), small_case(name), path) == path
    return small_case(name), small_verdict(name), path


def test_what_the_arm_stays_clear_of_comes_back_with_the_case(tmp_path):
    floor = '{ name = "floor", kind = "halfspace", position = [0, 0, -0.5] }'
    case = small_case("plate").with_overrides([f"collision.scene=[{floor}]"])
    verdict = replace(small_verdict("plate"), task=case.built_task())
    loaded = load_result(save_result(verdict, case, tmp_path / "a.result"))
    assert loaded.case == case
    assert loaded.verdict.task.standoff == verdict.task.standoff
    assert loaded.verdict.task.collision.checked == ("self", "surface", "scene")
    assert loaded.verdict.task.collision.scene[0].placement[2, 3] == -0.5


def test_every_key_of_the_task_comes_back(tmp_path):
    numbers = {
        "speed": "0.02", "min_manipulability": "1e-3", "home_deg": "[0, -90, 90, 0, 90, 0]",
        "approach": "[0, 0, -1]", "roll_deg": "[-90, 90]", "roll_reference": "[0, 1, 0]",
        "footprint": "[0.06, 0.04]", "coverage": "0.9", "tolerance": "0.002",
    }  # fmt: skip
    case = small_case("plate").with_overrides([f"task.{key}={v}" for key, v in numbers.items()])
    assert all(getattr(case.task, field.name) is not None for field in fields(case.task)
               if field.name not in ("collision", "smooth"))  # fmt: skip
    verdict = replace(small_verdict("plate"), task=case.task)
    assert load_result(save_result(verdict, case, tmp_path / "a.result")).verdict.task == case.task


def test_a_result_comes_back_exactly(saved):
    case, before, path = saved
    loaded = load_result(path)
    after = loaded.verdict
    assert loaded.case == case
    assert loaded.case.name == case.name
    assert loaded.version == result.version()
    for name in ("answer", "evidence", "message", "method", "seed", "start", "causes", "task"):
        assert getattr(after, name) == getattr(before, name), name
    assert after.n_edges == before.n_edges == before.graph.number_of_edges()
    assert dict(after.timing) == dict(before.timing)
    assert dict(after.statistics) == result.plain(before.statistics)
    assert np.array_equal(after.covered, before.covered)
    assert (after.postures is None) == (before.postures is None)
    if before.postures is not None:
        assert np.array_equal(after.postures, before.postures)
        assert after.postures.shape == (len(after.components), after.robot.n)
    assert [part.tolist() for part in after.components] == [
        part.tolist() for part in before.components
    ]
    same_graph(before.graph, after.graph)
    assert (after.tree is None) == (before.tree is None)
    if before.tree is not None:
        same_graph(before.tree, after.tree)
    assert (after.witness is None) == (before.witness is None)
    if before.witness is not None:
        assert np.array_equal(after.witness.q, before.witness.q)
        assert np.array_equal(after.witness.cell, before.witness.cell)
    assert after.certificate == before.certificate
    assert repr(after) == repr(before)
    assert np.array_equal(after.cells.centres, before.cells.centres)
    assert np.array_equal(after.robot.lower, before.robot.lower)


def test_the_same_verdict_gives_the_same_bytes(saved, tmp_path):
    case, _, path = saved
    save_result(load_result(path).verdict, case, tmp_path / "again")
    assert (tmp_path / "again").read_bytes() == path.read_bytes()


def test_the_small_cases_are_one_of_each():
    answers = {name: str(small_verdict(name).answer) for name in TEXTS}
    assert answers == {
        "plate": "feasible",
        "long plate": "infeasible",
        "greedy dome": "feasible",
    }
    assert small_verdict("plate").witness is not None
    assert small_verdict("greedy dome").tree is not None
    assert small_verdict("long plate").causes


def test_no_pickle_is_in_the_file(saved):
    with zipfile.ZipFile(saved[2]) as file:
        for name in file.namelist():
            if name.endswith(".npy"):
                array = np.load(io.BytesIO(file.read(name)), allow_pickle=False)
                assert array.dtype in (np.float64, np.int64)
            else:
                assert name == archive.TEXT_MEMBER


@pytest.fixture(scope="module")
def members(tmp_path_factory):
    """The members of a good file."""
    path = tmp_path_factory.mktemp("results") / "good"
    save_result(small_verdict("plate"), small_case("plate"), path)
    with zipfile.ZipFile(path) as file:
        return {name: file.read(name) for name in file.namelist()}


def npy(array, **options):
    stream = io.BytesIO()
    np.save(stream, array, **options)
    return stream.getvalue()


def meta(members, **changes):
    """The members with other entries in the JSON; None removes one."""
    entries = {**json.loads(members["meta.json"]), **changes}
    kept = {key: value for key, value in entries.items() if value is not ...}
    return {**members, "meta.json": json.dumps(kept).encode()}


def with_array(members, name, array):
    return {**members, f"{name}.npy": npy(array)}


def lying_header(shape):
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}"
    text = header.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode()


def case_of(members, **changes):
    return meta(members, case={**json.loads(members["meta.json"])["case"], **changes})


ORIGIN = {"cell": 0, "kind": "collision", "proved": True, "detail": ""}
DAMAGED = {
    "no meta": (lambda m: {k: v for k, v in m.items() if k != "meta.json"}, "lacks 'meta.json'"),
    "meta is binary": (lambda m: {**m, "meta.json": b"\xff\xfe\x00"}, "is not JSON"),
    "meta is a list": (lambda m: {**m, "meta.json": b"[]"}, "is not a JSON object"),
    "meta has NaN": (lambda m: {**m, "meta.json": b'{"seed": NaN}'}, "no JSON number"),
    "meta is deep": (lambda m: {**m, "meta.json": b"[" * 200_000}, "is not JSON"),
    "other format": (lambda m: meta(m, format="something"), "is not a result file"),
    "later format": (lambda m: meta(m, format_version=5, version="9.1"), "'9.1'"),
    "format true": (lambda m: meta(m, format_version=True), "not a whole number"),
    "no version": (lambda m: meta(m, version=...), "version is nothing, not text"),
    "no case": (lambda m: meta(m, case="x"), "case is 'x', not an object"),
    "bad case": (lambda m: case_of(m, toml="[robot]\n"), "robot.name: is missing"),
    "other case": (
        lambda m: case_of(m, toml=small_case("greedy dome").to_toml()),
        "another 'puma560'",
    ),
    "other limits": (
        lambda m: case_of(
            m,
            toml=small_case("plate")
            .with_overrides(["robot.limits_deg.wrist_3_joint=[-90, 90]"])
            .to_toml(),
        ),
        "run the check again",
    ),
    "more cells": (
        lambda m: case_of(
            m, toml=small_case("plate").with_overrides(["surface.cells=[4, 4]"]).to_toml()
        ),
        "plane has 16 cells now, and had 12 then; run the check again",
    ),
    "unknown answer": (lambda m: meta(m, answer="perhaps"), "not one of feasible, infeasible"),
    "unknown cause": (lambda m: meta(m, causes=[{**ORIGIN, "kind": "rain"}]), "not one of"),
    "cause of no cell": (lambda m: meta(m, causes=[{**ORIGIN, "cell": 12}]), "no cell of 12"),
    "cause is a number": (lambda m: meta(m, causes=[3]), "not an object"),
    "start is no cell": (lambda m: meta(m, start=-1), "no cell of 12"),
    "first format": (lambda m: meta(m, format_version=2), "reads formats 3 and 4"),
    "answer without its evidence": (lambda m: meta(m, evidence="proof"), "with the evidence proof"),
    "certificate": (lambda m: meta(m, certificate={"waypoints": "many"}), "not a whole number"),
    "timing": (lambda m: meta(m, timing={"load_s": "long"}), "not a number"),
    "no array": (lambda m: {k: v for k, v in m.items() if "covered" not in k}, "lacks 'covered"),
    "array is text": (lambda m: {**m, "graph_q.npy": b"0, 1, 2"}, "is no array"),
    "array of objects": (
        lambda m: {**m, "covered.npy": npy(np.array([None, {}]), allow_pickle=True)},
        "Object arrays cannot be loaded",
    ),
    "pickle": (lambda m: {**m, "covered.npy": pickle.dumps(os.getcwd)}, "is no array"),
    "array of floats": (lambda m: with_array(m, "covered", np.zeros(3)), "holds float64"),
    "array of another shape": (lambda m: with_array(m, "graph_q", np.zeros((12, 7))), "not 12 x 6"),
    "array cut short": (lambda m: {**m, "graph_q.npy": m["graph_q.npy"][:-8]}, "is damaged"),
    "array claims the world": (
        lambda m: {**m, "graph_motions.npy": lying_header((10**15, 6))},
        "is damaged",
    ),
    "array of negative length": (
        lambda m: {**m, "graph_motions.npy": lying_header((-1, 6))},
        "graph_motions",
    ),
    "NaN": (lambda m: with_array(m, "witness_q", np.full((len_of(m), 6), np.nan)), "NaN"),
    "covered is no cell": (lambda m: with_array(m, "covered", np.array([12])), "no cells"),
    "walk visits no cell": (
        lambda m: with_array(m, "witness_cell", np.full(len_of(m), 99)),
        "no cells",
    ),
    "edge to itself": (
        lambda m: with_array(m, "graph_edges", np.zeros((edges_of(m), 2), dtype=int)),
        "no edges",
    ),
    "edge of no cell": (
        lambda m: with_array(m, "graph_edges", np.full((edges_of(m), 2), -1)),
        "no cells of 12",
    ),
    "motions do not fit": (
        lambda m: with_array(m, "graph_motion_lengths", np.full(edges_of(m), 10**18)),
        "does not fit",
    ),
    "postures do not fit": (
        lambda m: with_array(m, "postures", np.zeros((1, 2))),
        "postures",
    ),
    "components do not fit": (
        lambda m: with_array(m, "components_lengths", np.array([1])),
        "does not fit",
    ),
}


def len_of(members):
    return len(np.load(io.BytesIO(members["witness_cell.npy"])))


def edges_of(members):
    return len(np.load(io.BytesIO(members["graph_edges.npy"])))


def pack(path, members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in members.items():
            file.writestr(name, data)
    return path


@pytest.mark.parametrize("name", DAMAGED, ids=str)
def test_a_damaged_file_is_refused(name, members, tmp_path):
    damage, words = DAMAGED[name]
    path = pack(tmp_path / "bad.result", damage(members))
    with pytest.raises(ResultError, match=r"bad\.result") as caught:
        load_result(path)
    assert words in str(caught.value)
    assert len(str(caught.value)) < 1000


def test_the_undamaged_members_load(members, tmp_path):
    assert load_result(pack(tmp_path / "good", members)).verdict.feasible


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is not a result file"),
        (b"PK\x03\x04 cut off", "is not a result file"),
        (b"[robot]\nname = 'puma560'\n", "is not a result file"),
        (b"\x80\x04K\x01.", "is not a result file"),
    ],
)
def test_files_of_another_kind_are_refused(content, words, tmp_path):
    path = tmp_path / "x"
    path.write_bytes(content)
    with pytest.raises(ResultError, match=words):
        load_result(path)


def test_folders_pipes_and_missing_files_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, words in ((tmp_path, "folder"), (tmp_path / "pipe", "regular"), ("no", "no such")):
        with pytest.raises(ResultError, match=words):
            load_result(path)


def test_a_bomb_is_not_inflated(members, tmp_path, monkeypatch):
    monkeypatch.setattr(archive, "LARGEST_CONTENT", 1 << 20)
    bomb = pack(tmp_path / "bomb", {**members, "covered.npy": bytes(10 << 20)})
    assert bomb.stat().st_size < 1 << 20
    with pytest.raises(ResultError, match="would inflate to 10 MB"):
        load_result(bomb)
    # The same, with headers that claim less than there is.
    data = bomb.read_bytes().replace((10 << 20).to_bytes(4, "little"), (100).to_bytes(4, "little"))
    bomb.write_bytes(data)
    with pytest.raises(ResultError, match=r"'covered\.npy'"):
        load_result(bomb)


def test_members_twice_or_without_end_are_refused(members, tmp_path):
    with zipfile.ZipFile(tmp_path / "twice", "w") as file:
        for name, data in members.items():
            file.writestr(name, data)
        with pytest.warns(UserWarning, match="Duplicate"):
            file.writestr("meta.json", b"{}")
    with pytest.raises(ResultError, match="twice"):
        load_result(tmp_path / "twice")
    many = {**members, **{f"x{k}": b"" for k in range(100)}}
    with pytest.raises(ResultError, match="more than 64"):
        load_result(pack(tmp_path / "many", many))


def test_the_file_is_not_read_beyond_its_cap(members, tmp_path, monkeypatch):
    monkeypatch.setattr(archive, "LARGEST_FILE", 1000)
    with pytest.raises(ResultError, match="larger than 1000 bytes"):
        load_result(pack(tmp_path / "large", members))


def test_flipped_bytes_and_cut_files_never_escape(members, tmp_path):
    good = pack(tmp_path / "good", members).read_bytes()
    chance = random.Random(3)
    refused = 0
    for k in range(150):
        data = bytearray(good)
        if k % 3 == 0:
            del data[chance.randrange(len(data)) :]
        else:
            for _ in range(chance.choice([1, 4, 30])):
                data[chance.randrange(len(data))] = chance.randrange(256)
        (tmp_path / "bad").write_bytes(data)
        try:
            load_result(tmp_path / "bad")
        except ResultError:
            refused += 1
    assert refused > 100  # a flip in a date or a name of no interest is harmless


def test_saving_is_all_or_nothing(tmp_path, monkeypatch):
    path = tmp_path / "a.result"
    path.write_bytes(b"what was there")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ResultError, match=r"a\.result: cannot be written: no space left"):
        save_result(small_verdict("plate"), small_case("plate"), path)
    assert path.read_bytes() == b"what was there"
    assert os.listdir(tmp_path) == ["a.result"]
    monkeypatch.undo()
    save_result(small_verdict("plate"), small_case("plate"), path)
    assert load_result(path).verdict.feasible
    assert os.listdir(tmp_path) == ["a.result"]


def test_a_full_disk_is_named():
    with pytest.raises(ResultError, match="/dev/full: cannot be written: no space left"):
        save_result(small_verdict("plate"), small_case("plate"), "/dev/full")


def test_places_that_cannot_be_written_are_named(tmp_path):
    args = small_verdict("plate"), small_case("plate")
    with pytest.raises(ResultError, match="there is no folder"):
        save_result(*args, tmp_path / "no" / "a.result")
    with pytest.raises(ResultError, match="is a folder"):
        save_result(*args, tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(ResultError, match="there is no folder"):
        save_result(*args, tmp_path / "file" / "a.result")


def test_a_new_file_has_the_usual_permissions_and_links_are_followed(tmp_path):
    case = Case.from_toml(small_case("plate").to_toml())
    save_result(small_verdict("plate"), case, tmp_path / "new")
    (tmp_path / "plain").touch()
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "plain").stat().st_mode
    (tmp_path / "link").symlink_to("plain")
    save_result(small_verdict("plate"), case, tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert load_result(tmp_path / "plain").verdict.feasible


def test_no_other_thread_sees_another_umask(tmp_path, monkeypatch):
    """Nor is a page that cannot be written left half written."""
    monkeypatch.setattr(os, "umask", None)
    page = tmp_path / "page.html"
    drawn = view(small_verdict("plate"))
    assert drawn.save_html(page) == page
    monkeypatch.setattr(os, "replace", lambda *_: no_space())
    with pytest.raises(FileError, match="cannot be written"):
        drawn.save_html(page)
    assert [file.name for file in tmp_path.iterdir()] == ["page.html"]


def no_space():
    raise OSError(28, "No space left on device")
