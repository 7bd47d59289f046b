"""Arguments from Python: every fault is named, with the values that would be accepted."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from coverable_errors import CoverableError, worded
from feasibility import Search, Task, check
from feasibility.certification.lever_bounds import peaks
from robots import load_robot
from surfaces import plane

BAD_TASK = {
    "standoff": (-0.1, math.nan, math.inf, "0.1", None, True, np.zeros(1)),
    "cone_deg": (-1, 180.1, math.nan, "45", None, 1j),
    "tolerance": (0, -1e-3, math.nan, math.inf, "1", False),
}
BAD_SEARCH = {
    "method": ("x", None, 3),
    "seed": (-1, 1.5, "0", None),
    "time_limit": (0, -1, math.nan, math.inf, "9"),
    "step_deg": (0, 31, math.nan, "1", None),
    "moves": ("one", None),
    "starts": (0, 1.5, "some", None),
    "cap": (0, 1.5, "9"),
}


@pytest.mark.parametrize(
    ("kind", "good", "bad"),
    [(Task, {"standoff": 0.01, "cone_deg": 45}, BAD_TASK), (Search, {}, BAD_SEARCH)],
)
def test_every_set_of_faults_is_named_and_nothing_else(kind, good, bad) -> None:
    kind(**good)
    rng = np.random.default_rng(0)
    for count in range(1, len(bad) + 1):
        for names in itertools.combinations(bad, count):
            wrong = {name: bad[name][rng.integers(len(bad[name]))] for name in names}
            with pytest.raises(CoverableError) as caught:
                kind(**{**good, **wrong})
            faults = caught.value.faults
            assert [fault.key for fault in faults] == list(names)
            for fault, value in zip(faults, wrong.values(), strict=True):
                assert fault.fault == f"got {value!r}"
                assert worded(fault) in str(caught.value)


@pytest.mark.parametrize("kind", [Task, Search])
def test_each_bad_value_is_refused(kind) -> None:
    good = {"standoff": 0.01, "cone_deg": 45} if kind is Task else {}
    for name, values in (BAD_TASK if kind is Task else BAD_SEARCH).items():
        for value in values:
            with pytest.raises(ValueError, match=f": {name} must "):
                kind(**{**good, name: value})


def test_numbers_of_numpy_will_do() -> None:
    task = Task(standoff=np.float64(0.02), cone_deg=np.int64(20), tolerance=np.float32(0.001))
    search = Search(seed=np.int64(3), starts=np.int32(2), time_limit=np.float64(5))
    plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
    assert check(load_robot("ur5"), plate.cells(2, 2), task, search).feasible


def test_arguments_in_another_order_or_of_another_kind() -> None:
    plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
    good = (load_robot("ur5"), plate.cells(2, 2), Task(standoff=0.02, cone_deg=20), Search())
    names = ("robot", "cells", "task", "search")
    bad = ("ur5", plate, {"standoff": 0.02}, "greedy")
    for which in itertools.product((False, True), repeat=4):
        given = [b if w else g for w, g, b in zip(which, good, bad, strict=True)]
        wrong = [name for name, w in zip(names, which, strict=True) if w]
        if not wrong:
            continue
        with pytest.raises(TypeError) as caught:
            check(*given)
        faults = str(caught.value).split("; ")
        assert [fault.split(":")[0] for fault in faults] == wrong
    with pytest.raises(TypeError, match=r"robot: .*cells: .*task: "):
        check(good[2], good[0], good[1])


def test_ends_without_bounds_are_unknown_and_no_warning() -> None:
    ends = np.array([np.inf, 1.0])
    assert np.array_equal(peaks(ends, ends, np.array([np.inf, 0.0])), [np.nan, 1.0], equal_nan=True)
