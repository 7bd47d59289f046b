"""Arguments from Python: every fault is named, with the values that would be accepted."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from coverable_errors import CoverableError, worded
from feasibility import Search, Task, check
from robots import load_robot
from surfaces import plane

BAD = {
    Task: {
        "standoff": (-0.1, math.nan, math.inf, "0.1", None, True, np.zeros(1)),
        "cone_deg": (-1, 180.1, math.nan, "45", None, 1j),
        "tolerance": (0, -1e-3, math.nan, math.inf, "1", False),
    },
    Search: {
        "method": ("x", None, 3), "seed": (-1, 1.5, "0", None),
        "time_limit": (0, -1, math.nan, math.inf, "9"), "step_deg": (0, 31, math.nan, "1", None),
        "moves": ("one", None), "starts": (0, 1.5, "some", None), "cap": (0, 1.5, "9"),
    },
}  # fmt: skip
GOOD = {Task: {"standoff": 0.01, "cone_deg": 45}, Search: {}}


@pytest.mark.parametrize("kind", [Task, Search])
def test_every_set_of_faults_is_named_and_nothing_else(kind):
    bad, rng = BAD[kind], np.random.default_rng(0)
    alone = [{name: value} for name, values in bad.items() for value in values]
    sets = [names for n in range(2, len(bad) + 1) for names in itertools.combinations(bad, n)]
    several = [{name: bad[name][rng.integers(len(bad[name]))] for name in names} for names in sets]
    for wrong in (*alone, *several):
        with pytest.raises(CoverableError) as caught:
            kind(**{**GOOD[kind], **wrong})
        faults = caught.value.faults
        assert [fault.key for fault in faults] == list(wrong)
        for fault, value in zip(faults, wrong.values(), strict=True):
            assert fault.fault == f"got {value!r}"
            assert worded(fault) in str(caught.value)
            assert f"{fault.key} must " in str(caught.value)


def test_arguments_in_another_order_or_of_another_kind():
    plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
    good = (load_robot("ur5"), plate.cells(2, 2), Task(standoff=0.02, cone_deg=20), Search())
    names, bad = ("robot", "cells", "task", "search"), ("ur5", plate, {"standoff": 0.02}, "greedy")
    for which in itertools.product((False, True), repeat=4):
        wrong = [name for name, w in zip(names, which, strict=True) if w]
        if wrong:
            with pytest.raises(TypeError) as caught:
                check(*(b if w else g for w, g, b in zip(which, good, bad, strict=True)))
            assert [fault.split(":")[0] for fault in str(caught.value).split("; ")] == wrong
    with pytest.raises(TypeError, match=r"robot: .*cells: .*task: "):
        check(good[2], good[0], good[1])
