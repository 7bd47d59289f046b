"""Kernels that kernels call: what comes out, and that each is translated once."""

from __future__ import annotations

from collections import Counter
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core import event
from numba.core.errors import TypingError

from coverable_kernels import njit


class Inner(NamedTuple):
    values: Any
    count: int


class Whole(NamedTuple):
    inner: Inner
    table: Any
    flag: bool


class Same(NamedTuple):
    first: float
    second: float


@njit()
def scaled(inner, factor=2.0):  # type: ignore[no-untyped-def]
    """Write to an array of the caller's."""
    for k in range(inner.count):
        inner.values[k] *= factor
    if inner.values[0] > 1e3:
        raise ValueError("too much")
    return inner.values[0]


@njit()
def summed(whole, same):  # type: ignore[no-untyped-def]
    """Hand on a part, and a named tuple that is made here, many times."""
    total = 0.0
    for k in range(3):
        made = Inner(whole.table[k], 2 - k % 2)
        total += scaled(whole.inner) + scaled(made, np.float64(1 + k)) + same.second - same.first
    return total if whole.flag else -total


@njit()
def both(whole, same):  # type: ignore[no-untyped-def]
    """Another caller; it returns a named tuple."""
    return Same(summed(whole, same), scaled(whole.inner, np.float64(1.0)))


def given() -> tuple[Whole, Same]:
    """Arguments."""
    return Whole(Inner(np.ones(4), 3), np.arange(1.0, 7.0).reshape(3, 2), False), Same(1.0, 4.0)


class Compilations(event.Listener):  # type: ignore[misc]
    """Counts them by function and types."""

    def __init__(self) -> None:
        """None yet."""
        self.seen: Counter[tuple[str, str]] = Counter()

    def on_start(self, about: Any) -> None:
        """One begins."""
        self.seen[about.data["dispatcher"].__name__, str(about.data["args"])] += 1

    def on_end(self, about: Any) -> None:
        """It ends."""


@pytest.fixture(scope="module")
def compilations() -> Compilations:
    """All of this module, whose kernels have been compiled."""
    listener = Compilations()
    with event.install_listener("numba:compile", listener):
        both(*given())
        summed(*given())
    return listener


def test_results_are_those_of_python(compilations: Compilations) -> None:
    for function in (both, summed):
        compiled, plain = given(), given()
        with pytest.MonkeyPatch.context() as patch:
            for kernel in (scaled, summed):
                patch.setitem(globals(), kernel.py_func.__name__, kernel.py_func)
            expected = function.py_func(*plain)
        result = function(*compiled)
        assert result == expected
        assert isinstance(result, Same) == (function is both)
        assert (compiled[0].inner.values == plain[0].inner.values).all()
        assert list(plain[0].inner.values > 1.0) == [True, True, True, False]


def test_each_kernel_is_translated_once(compilations: Compilations) -> None:
    ours = {
        key: n for key, n in compilations.seen.items() if key[0] in ("scaled", "summed", "both")
    }
    assert set(ours.values()) == {1}
    # For Python and for kernels; of two kinds of arguments where a default is used.
    assert Counter(name for name, _ in ours) == {"both": 2, "summed": 2, "scaled": 2}


def test_exceptions_come_through(compilations: Compilations) -> None:
    whole, same = given()
    whole.inner.values[0] = 1e3
    with pytest.raises(ValueError, match="too much"):
        summed(whole, same)


def test_a_field_that_is_not_there_is_refused() -> None:
    @njit()
    def inside(whole):  # type: ignore[no-untyped-def]
        return whole.nothing

    @njit()
    def outside(whole):  # type: ignore[no-untyped-def]
        return inside(whole)

    with pytest.raises(TypingError, match="nothing"):
        outside(given()[1])
