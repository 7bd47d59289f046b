"""Compiled functions, kept on disk for as long as nothing that they were compiled from changes.

numba keeps what it has compiled until the file of that function changes. What a kernel calls, and
the constants that it reads, are compiled into it, whichever files they stand in: with another
version of those, a kernel that was kept would run on with the old ones, and give wrong results
without a word. So a kept kernel holds only where its stamp does: the code of its function, every
value that this code names, and the same again of every function among those. The stamp is in the
name of its file (`coverable_kernel_files.py`), with the types of its arguments.

Take `njit` and `cfunc` from here, not from numba.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Iterator
from enum import Enum
from functools import cache
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from numba.core import compiler, types
from numba.core.ccallback import CFunc
from numba.core.serialize import dumps

import coverable_inner_kernels
from coverable_inner_kernels import compiled_for_python, without_bitcode
from coverable_kernel_files import Kernel, Processor, keep, load

__all__ = ["cfunc", "njit"]

OURS = ("robots", "surfaces", "feasibility", "coverable_")
PLAIN = (int, float, complex, str, bytes, type(None), type(...), np.generic, np.dtype)
LIBRARY = (ModuleType, FunctionType, BuiltinFunctionType, np.ufunc, types.Type)
COMPILED = ("py_func", "_defn", "_pyfunc")  # what compiled functions and intrinsics are made of
# How kernels are compiled is in these files.
HOW = b"".join(Path(str(f)).read_bytes() for f in (__file__, coverable_inner_kernels.__file__))
KEPT_IN: set[Path | None] = set()
"""Folders in which kernels of this process were kept; None for those that were kept nowhere."""
Function = Any
"""A Python function."""


def njit(**options: Any) -> Callable[[Function], Any]:
    """numba's decorator; what it compiles is kept if `cache` is among the options."""
    kept = options.pop("cache", False)

    def decorate(function: Function) -> Any:
        compiled = compiled_for_python(function, options)
        if kept and compiled is not function:  # as it is where the compiler is switched off
            compiled._cache = KeptKernels(function, options)
        return compiled

    return decorate


def cfunc(signature: Any, **options: Any) -> Callable[[Function], Any]:
    """numba's decorator for functions that are called by their address; they are kept as above."""
    kept = options.pop("cache", False)

    def decorate(function: Function) -> Any:
        arguments = signature.args, signature.return_type
        compiled: Any = CFunc(function, arguments, locals={}, options=options)
        if kept:
            compiled._cache = KeptKernels(function, options)
        compiled.compile()
        return compiled

    return decorate


class KeptKernels:
    """What was compiled of one function, on disk, in the form in which numba asks for it."""

    def __init__(self, function: Function, options: dict[str, Any]) -> None:
        """Nothing is read yet."""
        self._function, self._options = function, options
        self._source = Path(inspect.getfile(function))
        self.cache_path = str(self._source.parent)

    def kernel(self, signature: Any, codegen: Any) -> Kernel:
        """Of the function as it is, for some types of arguments.

        numba asks before it looks for a kernel, and before it keeps one: by then all that the
        function calls is there, which it need not be where the function is made.
        """
        arguments = getattr(signature, "args", signature)
        return Kernel(
            f"{self._function.__module__}.{self._function.__qualname__}",
            stamp(self._function, self._options),
            repr([str(signature), *map(_layout, arguments)]),
            Processor(*codegen.magic_tuple()),
        )

    def load_overload(self, signature: Any, target: Any) -> Any:
        """The compiled function; None where it has to be compiled."""
        target.refresh()  # by which numba itself prepares to load one
        parts = load(self.kernel(signature, target.codegen()), self._source)
        return None if parts is None else compiler.CompileResult._rebuild(target, *parts)

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep it, where that is possible."""
        if not compiled.library.has_dynamic_globals:  # such as addresses
            without_bitcode(compiled.library)
            content = dumps(compiled._reduce())
            KEPT_IN.add(keep(self.kernel(signature, compiled.codegen), self._source, content))

    def flush(self) -> None:
        """numba would compile anew what has been compiled; names of files see to that here."""


def _layout(kind: Any) -> tuple[Any, ...]:
    """Class and names of the fields of all named tuples in a type of numba's, in their order."""
    has_parts, has_fields = (isinstance(kind, t) for t in (types.BaseTuple, types.BaseNamedTuple))
    inside = tuple(map(_layout, kind.types)) if has_parts else ()
    if not has_fields:
        return inside
    return kind.instance_class.__module__, kind.instance_class.__qualname__, kind.fields, *inside


def stamp(function: Function, options: dict[str, Any]) -> str:
    """A hash of a function's code, all values that it names, and the same of functions among them.

    Args:
        function: a Python function, which is to be compiled.
        options: how.

    Raises:
        TypeError: if one of them is of a kind that it is not known how to compare.

    Example:
        >>> def add(x):
        ...     return x + 1
        >>> stamp(add, {}) == stamp(add, {"fastmath": True})
        False
    """
    found: dict[Function, bytes] = {}
    waiting = [function]
    while waiting:
        reached = waiting.pop()
        if reached not in found:
            found[reached], functions = _parts(reached)
            waiting += functions
    whole = hashlib.sha256(HOW + repr(sorted(options.items())).encode())
    for part in sorted(set(found.values())):
        whole.update(part)
    return whole.hexdigest()


@cache
def _parts(function: Function) -> tuple[bytes, list[Function]]:
    """A hash of what a function is by itself, and the functions that it names."""
    functions: list[Function] = []
    text = [_code(function)]
    for name, value in _named(function):
        text.append(f"{name} = {_described(value, functions)}")
    return hashlib.sha256("\n".join(text).encode()).digest(), functions


@cache
def _code(function: Function) -> str:
    """A hash of a function's code, without its place in its file and without its description."""

    def text(code: CodeType) -> str:
        constants = list(map(constant, code.co_consts))
        names = code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars
        return repr((code.co_code, code.co_flags, constants, names))

    def constant(value: object) -> str:
        if isinstance(value, frozenset):
            return repr(sorted(map(repr, value)))
        if isinstance(value, CodeType):
            return text(value)
        return repr(value) if value != function.__doc__ else ""

    return hashlib.sha256(text(function.__code__).encode()).hexdigest()


def _named(function: Function) -> Iterator[tuple[str, object]]:
    """What a function's code names, and its defaults; names of attributes are among the names."""
    yield "defaults", (function.__defaults__, tuple((function.__kwdefaults__ or {}).items()))
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    yield from ((name, cell.cell_contents) for name, cell in cells)
    waiting, names = [function.__code__], set()
    while waiting:
        code = waiting.pop()
        waiting += [inner for inner in code.co_consts if isinstance(inner, CodeType)]
        names.update(code.co_names)
    for name in sorted(names & function.__globals__.keys()):
        yield name, function.__globals__[name]


def _described(value: Any, functions: list[Function]) -> str:
    """A value as text; functions in it are told by names and code, and added to the list."""
    inner = next((vars(value)[kind] for kind in COMPILED if kind in _held(value)), value)
    if isinstance(inner, FunctionType) and (inner is not value or _is_ours(value)):
        functions.append(inner)
        options = sorted(_held(value).get("targetoptions", {}).items())
        return f"{inner.__module__}.{inner.__qualname__} {options} {_code(inner)}"
    if isinstance(value, type):
        fields = getattr(value, "_fields", ()), getattr(value, "_field_defaults", {})
        members = [(name, item.value) for name, item in getattr(value, "__members__", {}).items()]
        return f"{value.__module__}.{value.__qualname__} {fields} {members}"
    if isinstance(value, Enum):
        return f"{_described(type(value), functions)} {value.name}"
    if isinstance(value, tuple):
        return f"{_described(type(value), functions)} {[_described(v, functions) for v in value]}"
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {value.strides} {value.tobytes()!r}"
    if isinstance(value, PLAIN):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, LIBRARY) and not _is_ours(value):
        return f"{getattr(value, '__module__', '')}.{getattr(value, '__name__', value)}"
    raise TypeError(f"a kernel names {value!r}, and it is not known how to tell when that changes")


def _held(value: Any) -> dict[str, Any]:
    """What an object holds by itself."""
    return getattr(value, "__dict__", {})


def _is_ours(value: Any) -> bool:
    """Does a module, class or function belong to this project?"""
    name = value.__name__ if isinstance(value, ModuleType) else value.__module__
    return str(name).startswith(OURS)
