"""How the search kernels are compiled: without counting references, and from what."""

import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from numba.core import types

import feasibility
from coverable import Task, check, load_robot, plane
from coverable.kernels import CODE, ROOT
from feasibility.roadmap.warmup import warm_up


def dispatchers() -> Iterator[tuple[str, Any]]:
    for found in pkgutil.walk_packages(feasibility.__path__, "feasibility."):
        if "__main__" in found.name:
            continue
        module = importlib.import_module(found.name)
        for name, value in vars(module).items():
            if hasattr(value, "py_func") and value.py_func.__module__ == module.__name__:
                yield f"{found.name}.{name}", value


def holds_arrays(kind: types.Type) -> bool:
    inner = kind.types if isinstance(kind, types.BaseTuple) else ()
    return isinstance(kind, types.Array) or any(map(holds_arrays, inner))


def tuples_in(kind: types.Type) -> Iterator[type]:
    if isinstance(kind, types.BaseNamedTuple):
        yield kind.instance_class
    for inner in kind.types if isinstance(kind, types.BaseTuple) else ():
        yield from tuples_in(inner)


def test_no_kernel_that_counts_no_references_returns_an_array() -> None:
    """Its caller would free an array that it was not given.

    And the named tuples that kernels are given are among the code that they are kept by.
    """
    code = {path for pattern in CODE for path in ROOT.glob(pattern)}
    plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
    assert check(load_robot("ur5"), plate.cells(2, 2), Task(standoff=0.02, cone_deg=30)).feasible
    warm_up(rarely_used=True)
    counting, seen = 0, 0
    for name, found in dispatchers():
        kinds = [kind for one in found.overloads.values() for kind in one.signature.args]
        given = {Path(inspect.getfile(k)) for kind in kinds for k in tuples_in(kind)}
        assert given <= code, name
        if found.targetoptions.get("_nrt", True):
            counting += 1
            continue
        for overload in found.overloads.values():
            seen += 1
            assert not holds_arrays(overload.signature.return_type), name
    assert counting > 1
    assert seen > 5  # those that were called from Python
