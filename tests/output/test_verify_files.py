"""`verify` believes nothing that a file says: motions, trees, proofs and second statements."""

from dataclasses import replace

import numpy as np
import pytest
from command_table import forged

from coverable import Answer, Evidence, check, load_case, load_result, save_result, verify
from feasibility.cut_tree import CutTree, Leaf
from feasibility.results.result_file import ResultError
from feasibility.verifying import NothingToVerifyError


@pytest.fixture(scope="module")
def kept(commands):
    """name -> the file of a result, and what is in it."""
    for name in ("files", "cut", "greedy"):
        commands.run("check", name)

    def one(name):
        path = commands.folder / f"{name}.result"
        found = load_result(path)
        return path, found.verdict, found.case

    return one


@pytest.fixture
def said(ask, tmp_path):
    """said(verdict, case): what `verify` answers on a result that says so."""

    def of(verdict, case, **changes):
        path = save_result(verdict, case, tmp_path / "a.result")
        return ask("verify", forged(path, **changes) if changes else path)

    return of


def test_a_stored_motion_is_not_believed(kept, said):
    _, verdict, case = kept("plate")
    q = verdict.witness.q.copy()
    q[len(q) // 2] += 0.02
    answer = said(replace(verdict, witness=replace(verdict.witness, q=q)), case)
    assert answer.status == 1
    assert "the stored motion is refused" in answer.out


def test_a_stored_proof_is_not_believed(kept, said):
    _, verdict, case = kept("cut")
    covered = int(np.flatnonzero(verdict.covered)[0])
    answer = said(replace(verdict, proof=CutTree(Leaf(covered))), case)
    assert answer.status == 1
    assert "the stored proof is refused" in answer.out
    root = verdict.proof.root
    swapped = replace(root, below=root.above, above=root.below)
    assert said(replace(verdict, proof=replace(verdict.proof, root=swapped)), case).status == 1


def test_a_stored_tree_is_not_believed(kept, said):
    _, verdict, case = kept("greedy")
    tree = verdict.tree.copy()
    a, b = next(iter(tree.edges))
    tree.edges[a, b]["motion"] = tree.edges[a, b]["motion"] + 1e-3
    answer = said(replace(verdict, tree=tree), case)
    assert answer.status == 1
    assert "the tree of the greedy search is refused" in answer.out
    leaf = next(node for node in verdict.tree if verdict.tree.out_degree(node) == 0)
    tree = verdict.tree.copy()
    tree.remove_node(leaf)
    assert "1 cells are not in the tree" in said(replace(verdict, tree=tree), case).out

    def bent(values):
        values[-1] += 1e-3
        return values

    assert "is not the one that its motion leads to" in said(verdict, case, tree_q=bent).out
    assert said(verdict, case, tree_motions=bent).status == 1
    alone = case.with_overrides(["surface.cells=[1, 1]"])
    single = check(*alone.build())
    assert said(single, alone).status == 0
    assert said(single, alone, tree_q=lambda q: q + 0.5).status == 1


@pytest.mark.parametrize("evidence", [Evidence.EXHAUSTED, Evidence.PROOF])
def test_results_without_evidence_have_nothing_to_verify(kept, said, evidence):
    _, verdict, case = kept("cut")
    answer = said(replace(verdict, evidence=evidence, proof=None), case)
    words = {Evidence.EXHAUSTED: "ended without a motion", Evidence.PROOF: "was not kept"}
    assert (answer.status, answer.out) == (2, "")
    assert words[evidence] in answer.err
    assert verdict.answer is Answer.INFEASIBLE


def test_a_result_is_judged_by_the_one_statement_of_its_case(kept, said, tmp_path):
    """Standoff, cone and tolerance in meta.json are nobody's."""
    _, plate, case = kept("plate")
    _, proved, other = kept("cut")
    second = {"standoff": 0.005, "cone_deg": 22.6, "tolerance": None}

    def wide(text):
        return text.replace("cone_deg = 22.6", "cone_deg = 180.0")

    assert said(proved, other, text=wide, task=second).status == 1
    second = {"standoff": 0.02, "cone_deg": 30.0, "tolerance": None}

    def high(text):
        return text.replace("standoff = 0.02", "standoff = 0.03")

    assert "mm off its surface" in said(plate, case, text=high, task=second).out
    with pytest.raises(ResultError, match="not about case"):
        save_result(plate, other, tmp_path / "b.result")


DEMANDED = {
    "coverage": ("[task]", "[task]\nfootprint = 0.01\ncoverage = 0.99", "is required"),
    "collisions": ("[task]", "[collision]\nself = true\n[task]", "collisions: not judged"),
    "speed": ("[task]", "[task]\nspeed = 0.01", "speed: not judged"),
    "start": ("[robot]", "[robot]\nstart_deg = [0, 0, 0, 0, 0, 0]", "start"),
}


@pytest.mark.parametrize("demanded", DEMANDED)
def test_what_a_tree_was_not_judged_in_is_named_and_does_not_hold(kept, said, demanded):
    _, verdict, case = kept("greedy")
    before, after, words = DEMANDED[demanded]
    answer = said(verdict, case, text=lambda text: text.replace(before, after, 1))
    assert answer.status == 1
    assert words in answer.out or demanded == "coverage"
    assert "collisions are not checked" in answer.out


def test_verify_in_python(kept):
    _, verdict, _ = kept("plate")
    asked = verdict.robot, verdict.cells, verdict.task
    for q in (verdict.witness.q, verdict.witness.q.tolist()):
        assert verify(*asked, q).holds
    assert verify(verdict).holds
    assert not verify(*asked, verdict.witness.q[:3]).holds
    assert "no motion of 6 joints" in verify(*asked, np.zeros(6)).refusal
    for args, error in (
        ((*asked, [["a"]]), ValueError),
        ((verdict.robot, verdict.cells.surface, verdict.task, verdict.witness.q), TypeError),
        ((verdict, verdict.cells), TypeError),
        (("ur5",), TypeError),
    ):
        with pytest.raises(error):
            verify(*args)
    with pytest.raises(NothingToVerifyError):
        verify(check(*load_case("paper/4a", ["search.method=greedy", "surface.cells=[1, 1]"])
                     .build()))  # fmt: skip
