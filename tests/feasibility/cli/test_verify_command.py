"""`coverable verify`: exit statuses, and what is said, for motions, witnesses, trees and proofs."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from schema import Maybe, OneOf, ProofTree, conforms
from small_cases import TEXTS, paper_verdict, small_case, small_verdict

from feasibility import Answer, Evidence, NothingToVerifyError, check, verify
from feasibility.cases import load_case
from feasibility.cut_tree import CutTree, Leaf
from feasibility.reports import verdict as report
from feasibility.results import ResultError, load_result, save_result

VERIFY = {
    "verdict": OneOf("holds", "does not hold"),
    "claim": OneOf("motion", "witness", "tree", "proof"),
    "cells": int,
    "reached": Maybe(int),
    "missed": [[int]],
    "refusals": [{"row": Maybe(int), "share": Maybe(float), "text": str}],
    "certificate": Maybe(
        {
            "waypoints": int,
            "max_position_error_m": Maybe(float),
            "max_angle_deg": Maybe(float),
            "min_limit_margin_deg": Maybe(float),
        }
    ),
    "proof": Maybe({"kind": OneOf("cell", "cut"), "opened": dict, "tree": ProofTree()}),
    "boxes": Maybe(int),
    "treated": Maybe(dict),
    "not_judged": [str],
    "in_time": bool,
    "collisions": [str],
    "notes": [str],
    "robot": str,
    "version": str,
}


@pytest.fixture
def ask(ask):
    """Run `coverable verify` in this process: ask(arguments) -> status, stdout, stderr."""
    return partial(ask, "verify")


@pytest.fixture
def plate(tmp_path):
    """A case file, and the file of its witness."""
    case, motion = tmp_path / "plate.toml", tmp_path / "walk.csv"
    case.write_text(TEXTS["plate"])
    motion.write_text(report.as_csv(small_verdict("plate")))
    return case, motion


def as_json(out):
    answer = json.loads(out)
    opened = answer["proof"]["opened"] if answer["proof"] else {}
    schema = {**VERIFY}
    if answer["proof"]:
        inner = {**VERIFY["proof"].inner, "opened": dict.fromkeys(opened, float)}
        schema["proof"] = Maybe(inner)
    conforms(answer, schema)
    return answer


def test_a_motion_that_holds(ask, plate):
    status, out, _ = ask(*plate)
    assert status == 0
    assert out.startswith("holds: the motion covers the whole surface.")
    assert "12 of 12 cells reached" in out
    status, out, _ = ask(*plate, "--json")
    answer = as_json(out)
    assert answer["verdict"] == "holds"
    assert answer["refusals"] == answer["missed"] == []
    assert answer["notes"] == []


def test_a_motion_that_does_not(ask, plate):
    case, motion = plate
    status, out, _ = ask(case, motion, "--set", "task.standoff=0.025")
    assert status == 1
    assert out.startswith("does not hold")
    assert "5.0" in out
    assert "mm off its surface" in out
    status, out, _ = ask(case, motion, "--set", "surface.position=[0, 0, 0.35]", "--json")
    answer = as_json(out)
    assert status == 1
    assert answer["reached"] == 0
    assert answer["refusals"][0]["row"] >= 1
    lines = motion.read_text().splitlines()
    motion.write_text("\n".join(lines[: len(lines) // 2]) + "\n")
    status, out, _ = ask(case, motion, "--json")
    answer = as_json(out)
    assert status == 1
    assert len(answer["missed"]) == 12 - answer["reached"] > 0
    assert "never reached" in answer["refusals"][0]["text"]


def test_bad_input(ask, plate, tmp_path):
    case, motion = plate
    for args, word in (
        ((case, tmp_path / "none.csv"), "there is no such file"),
        ((case, case), "line 2: column"),
        ((tmp_path / "none.toml", motion), "there is no such file"),
        ((case,), "coverable verify CASE MOTION"),
        ((motion,), "coverable verify CASE MOTION"),
        (("paper/4a", motion), "has no column"),
        ((), "required"),
    ):
        status, out, err = ask(*args)
        assert status == 2, args
        assert out == ""
        assert word in err, err


@pytest.mark.parametrize("name", ["plate", "greedy dome"])
def test_results_that_are_feasible(ask, name, tmp_path):
    path = save_result(small_verdict(name), small_case(name), tmp_path / "a.result")
    status, out, _ = ask(path)
    assert status == 0, out
    assert as_json(ask(path, "--json")[1])["claim"] == (
        "tree" if name == "greedy dome" else "witness"
    )
    assert ask(path, "--set", "task.cone_deg=20")[0] == 2


def test_a_proved_result(ask, tmp_path):
    """Case 4d is one that the paper's table has as not coverable."""
    verdict = paper_verdict("4d")
    assert verdict.evidence is Evidence.PROOF
    assert verdict.proof is not None
    path = save_result(verdict, load_case("paper/4d"), tmp_path / "a.result")
    status, out, _ = ask(path)
    assert status == 0, out
    assert out.startswith("holds: no single continuous motion covers the whole surface.")
    answer = as_json(ask(path, "--json")[1])
    assert answer["claim"] == "proof"
    assert answer["boxes"] > 0
    covered = int(np.flatnonzero(verdict.covered)[0])
    wrong = replace(load_result(path).verdict, proof=CutTree(Leaf(covered)))
    save_result(wrong, load_case("paper/4d"), path)
    status, out, _ = ask(path)
    assert status == 1
    assert "the stored proof is refused" in out


def test_results_without_evidence(ask, tmp_path):
    verdict = replace(
        small_verdict("long plate"), answer=Answer.INFEASIBLE, evidence=Evidence.EXHAUSTED
    )
    for evidence, word in (
        (Evidence.EXHAUSTED, "ended without a motion"),
        (Evidence.PROOF, "its proof was not kept"),
    ):
        bare = replace(verdict, evidence=evidence, proof=None)
        path = save_result(bare, small_case("long plate"), tmp_path / "a.result")
        status, out, err = ask(path)
        assert status == 2
        assert out == ""
        assert word in err


def test_a_stored_witness_is_not_believed(ask, tmp_path):
    verdict = small_verdict("plate")
    q = verdict.witness.q.copy()
    q[len(q) // 2] += 0.02
    wrong = replace(verdict, witness=replace(verdict.witness, q=q))
    path = save_result(wrong, small_case("plate"), tmp_path / "a.result")
    status, out, _ = ask(path)
    assert status == 1
    assert "the stored motion is refused" in out


def test_a_stored_tree_is_not_believed(ask, tmp_path):
    verdict = small_verdict("greedy dome")
    tree = verdict.tree.copy()
    a, b = next(iter(tree.edges))
    tree.edges[a, b]["motion"] = tree.edges[a, b]["motion"] + 1e-3
    path = tmp_path / "a.result"
    save_result(replace(verdict, tree=tree), small_case("greedy dome"), path)
    status, out, _ = ask(path)
    assert status == 1
    assert "the tree of the greedy search is refused" in out
    leaf = next(node for node in verdict.tree if verdict.tree.out_degree(node) == 0)
    tree = verdict.tree.copy()
    tree.remove_node(leaf)
    save_result(replace(verdict, tree=tree), small_case("greedy dome"), path)
    assert "1 cells are not in the tree" in ask(path)[1]


def forged(path, text=str, task=None, **arrays):
    """The same result file with another text of its case, a second statement of it, or arrays."""
    with zipfile.ZipFile(path) as file:
        members = {name: file.read(name) for name in file.namelist()}
    meta = json.loads(members["meta.json"])
    meta["case"]["toml"] = text(meta["case"]["toml"])
    members["meta.json"] = json.dumps(meta | ({} if task is None else {"task": task})).encode()
    for name, change in arrays.items():
        buffer = io.BytesIO()
        np.save(buffer, change(np.load(io.BytesIO(members[f"{name}.npy"]))))
        members[f"{name}.npy"] = buffer.getvalue()
    with zipfile.ZipFile(f"{path}.forged", "w") as file:
        for name, data in members.items():
            file.writestr(name, data)
    return f"{path}.forged"


def test_a_result_is_judged_by_the_one_statement_of_its_case(ask, tmp_path):
    """Before, standoff, cone and tolerance came from a second one, in meta.json."""
    limits = "[[-60, 40], [-100, -20], [20, 120], [40, 130], [60, 140], [-200, -120]]"
    away = ["task.approach=[0, 0, 1]", "task.cone_deg=1", f"robot.limits_deg={limits}"]
    case = small_case("plate").with_overrides(away)
    verdict = check(*case.build())
    assert verdict.evidence is Evidence.PROOF
    path = save_result(verdict, case, tmp_path / "a.result")
    assert ask(path)[0] == 0
    second = {"standoff": 0.02, "cone_deg": 1.0, "tolerance": None}
    wide = forged(path, lambda text: text.replace("cone_deg = 1.0", "cone_deg = 180.0"), second)
    assert load_result(wide).verdict.task.cone_deg == 180.0
    assert ask(wide)[0] == 1
    path = save_result(small_verdict("plate"), small_case("plate"), path)
    high = forged(path, lambda text: text.replace("standoff = 0.02", "standoff = 0.03"), second)
    assert "mm off its surface" in ask(high)[1]
    with pytest.raises(ResultError, match="not about case"):
        save_result(small_verdict("plate"), case, path)


DEMANDED = {
    "coverage": ("[task]", "[task]\nfootprint = 0.01\ncoverage = 0.99", "is required"),
    "collisions": ("[task]", "[collision]\nself = true\n[task]", "collisions: not judged"),
    "speed": ("[task]", "[task]\nspeed = 0.01", "speed: not judged"),
    "start": ("[robot]", "[robot]\nstart_deg = [0, 0, 0, 0, 0, 0]", "start"),
}


@pytest.mark.parametrize("demanded", DEMANDED)
def test_what_a_tree_was_not_judged_in_is_named_and_does_not_hold(ask, demanded, tmp_path):
    path = save_result(
        small_verdict("greedy dome"), small_case("greedy dome"), tmp_path / "a.result"
    )
    old, new, word = DEMANDED[demanded]
    status, out, _ = ask(forged(path, lambda text: text.replace(old, new)))
    assert status == 1
    assert word in out or demanded == "coverage"
    assert "collisions are not checked" in out


def test_every_configuration_of_a_stored_tree_is_judged(ask, tmp_path):
    def bent(values):
        values[-1] += 1e-3
        return values

    verdict, case = small_verdict("greedy dome"), small_case("greedy dome")
    path = save_result(verdict, case, tmp_path / "a.result")
    assert "is not the one that its motion leads to" in ask(forged(path, tree_q=bent))[1]
    assert ask(forged(path, tree_motions=bent))[0] == 1
    alone = case.with_overrides(["surface.cells=[1, 1]"])
    path = save_result(check(*alone.build()), alone, path)
    assert ask(path)[0] == 0
    assert ask(forged(path, tree_q=lambda q: q + 0.5))[0] == 1


def test_verify_judges_all_that_a_case_demands_and_names_the_rest(ask, plate):
    treats = ("--set", "task.footprint=0.01", "--set", "task.coverage=0.99")
    status, out, _ = ask(*plate, *treats, "--json")
    answer = as_json(out)
    assert status == 1
    assert "99 % is required" in answer["refusals"][0]["text"]
    assert answer["not_judged"] == []
    status, out, _ = ask(*plate, *treats, "--set", "task.standoff=0.05", "--json")
    assert as_json(out)["not_judged"] == ["coverage"]
    assert ask(*plate, *treats, "--set", "task.coverage=0.05")[0] == 0


def test_verify_in_python():
    verdict = small_verdict("plate")
    asked = verdict.robot, verdict.cells, verdict.task
    assert verify(*asked, verdict.witness.q).holds
    assert verify(*asked, verdict.witness.q.tolist()).holds
    assert verify(verdict).holds
    assert not verify(*asked, verdict.witness.q[:3]).holds
    assert "no motion of 6 joints" in verify(*asked, np.zeros(6)).refusal
    with pytest.raises(ValueError, match="array"):
        verify(*asked, [["a"]])
    with pytest.raises(TypeError, match="expected a surface"):
        verify(verdict.robot, verdict.cells.surface, verdict.task, verdict.witness.q)
    with pytest.raises(TypeError, match="give it alone"):
        verify(verdict, verdict.cells)
    with pytest.raises(TypeError, match="expected a Robot, a Verdict or a Result"):
        verify("ur5")
    with pytest.raises(NothingToVerifyError):
        verify(small_verdict("greedy dome"))
