"""How the search kernels are compiled: without counting references to arrays."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from typing import Any

from numba.core import types

import feasibility
from feasibility import Task, check
from feasibility.roadmap import warm_up
from robots import load_robot
from surfaces import plane


def dispatchers() -> Iterator[tuple[str, Any]]:
    """All compiled functions of the package."""
    for found in pkgutil.walk_packages(feasibility.__path__, "feasibility."):
        if "__main__" in found.name:
            continue
        module = importlib.import_module(found.name)
        for name, value in vars(module).items():
            if hasattr(value, "py_func") and value.py_func.__module__ == module.__name__:
                yield f"{found.name}.{name}", value


def holds_arrays(kind: types.Type) -> bool:
    """Is there an array in a type?"""
    inner = kind.types if isinstance(kind, types.BaseTuple) else ()
    return isinstance(kind, types.Array) or any(map(holds_arrays, inner))


def test_no_kernel_that_counts_no_references_returns_an_array() -> None:
    """Its caller would free an array that it was not given."""
    plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
    assert check(load_robot("ur5"), plate.cells(2, 2), Task(standoff=0.02, cone_deg=30)).feasible
    warm_up(rarely_used=True)
    counting, seen = 0, 0
    for name, found in dispatchers():
        if found.targetoptions.get("_nrt", True):
            counting += 1
            continue
        for overload in found.overloads.values():
            seen += 1
            assert not holds_arrays(overload.signature.return_type), name
    assert counting > 5
    assert seen > 5  # those that were called from Python
