"""Proofs in result files: they come back as they were, and damaged ones are refused."""

from __future__ import annotations

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from small_cases import small_case, small_verdict

from feasibility import Evidence
from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.results import ResultError, load_result, save_result

TREE = CutTree(
    Cut(
        (0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
        -1.43,
        Cut((0.5, 0.0, 0.0, 1.0, 0.0, 0.0), 0.25, Leaf(3), Leaf(0)),
        Leaf(7),
    ),
    ((5, 3.1),),
)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A result file with a tree that proves nothing; whether it does is not asked here."""
    verdict = replace(small_verdict("long plate"), proof=TREE, evidence=Evidence.PROOF)
    path = tmp_path_factory.mktemp("proofs") / "a.result"
    return save_result(verdict, small_case("long plate"), path)


def test_a_proof_comes_back_as_it_was(saved):
    assert load_result(saved).verdict.proof == TREE


@pytest.mark.parametrize("tree", [CutTree(Leaf(2)), CutTree(Leaf(0), ((1, -0.5), (4, 0.0)))])
def test_a_single_leaf(tree, tmp_path):
    verdict = replace(small_verdict("long plate"), proof=tree)
    save_result(verdict, small_case("long plate"), tmp_path / "a")
    assert load_result(tmp_path / "a").verdict.proof == tree


def test_a_verdict_without_a_proof(tmp_path):
    save_result(small_verdict("plate"), small_case("plate"), tmp_path / "a")
    assert load_result(tmp_path / "a").verdict.proof is None


def change(path, target, **arrays):
    """The file with some arrays changed by functions; None leaves one out."""
    with zipfile.ZipFile(path) as file:
        members = {name: file.read(name) for name in file.namelist()}
    for name, edit in arrays.items():
        key = f"proof_{name}.npy"
        if edit is None:
            del members[key]
            continue
        stream = io.BytesIO()
        np.save(stream, edit(np.load(io.BytesIO(members[key]))))
        members[key] = stream.getvalue()
    with zipfile.ZipFile(target, "w") as file:
        for name, data in members.items():
            file.writestr(name, data)
    return target


def at(place, value):
    """An edit of one entry."""

    def edited(array):
        array[place] = value
        return array

    return edited


DAMAGES = {
    "no cells": ({"cell": None}, "lacks 'proof_cell.npy'"),
    "a node less": ({"cell": lambda a: a[:-1]}, "has the shape"),
    "a joint less": ({"weights": lambda a: a[:, :5]}, "has the shape"),
    "a cell too many": ({"cell": at(2, 8)}, "a leaf names no cell of 8"),
    "a cut with a cell": ({"cell": at(0, 3)}, "neither a cut with two sides nor a leaf"),
    "a leaf without": ({"cell": at(4, -1)}, "neither a cut with two sides nor a leaf"),
    "a circle": ({"sides": at((1, 0), 0)}, "a side of a cut is no later node"),
    "a side of its own": ({"sides": at((1, 0), 1)}, "a side of a cut is no later node"),
    "a side beyond": ({"sides": at((0, 1), 5)}, "a side of a cut is no later node"),
    "a side twice": ({"sides": at((0, 1), 3)}, "not the side of exactly one cut"),
    "no weights": ({"weights": at(0, 0.0)}, "a cut has no weight"),
    "a leaf with weights": ({"weights": at(2, 1.0)}, "a leaf has one"),
    "NaN": ({"value": at(0, np.nan)}, "NaN or infinite"),
    "infinite weights": ({"weights": at((0, 1), np.inf)}, "NaN or infinite"),
    "an opened joint beyond": ({"opened": at(0, 6)}, "what are no joints of 6"),
    "opened nowhere": ({"opened_at": lambda a: a[:0]}, "has the shape"),
    "no nodes": (
        {
            "cell": lambda a: a[:0],
            "weights": lambda a: a[:0],
            "value": lambda a: a[:0],
            "sides": lambda a: a[:0],
        },
        "it has 0 nodes",
    ),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_damaged_trees_are_refused(saved, tmp_path, name):
    arrays, word = DAMAGES[name]
    with pytest.raises(ResultError) as caught:
        load_result(change(saved, tmp_path / "bad", **arrays))
    assert word in str(caught.value), caught.value


def test_a_tree_that_is_too_deep(tmp_path):
    node = Leaf(0)
    for k in range(201):
        node = Cut((1.0, 0, 0, 0, 0, 0), 0.01 * k, Leaf(1), node)
    verdict = replace(small_verdict("long plate"), proof=CutTree(node))
    save_result(verdict, small_case("long plate"), tmp_path / "deep")
    with pytest.raises(ResultError, match="201 cuts deep"):
        load_result(tmp_path / "deep")
