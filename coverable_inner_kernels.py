"""Kernels as other kernels call them: each is translated once, and compiled with its callers alone.

numba compiles every function by itself, though most of ours are called by other kernels only: each
is made into fast machine code with all that it calls, and again inside each of its callers. And a
call hands on a named tuple as all numbers of all its arrays, which are hundreds. Here

- what a kernel calls is translated for LLVM and simplified, and the rest is done where Python
  calls: for a function that only calls the kernel;
- a kernel gets the place of a named tuple, and reads there what it needs;
- large kernels are called; LLVM would write them into loops, unroll these, and take very long.

The numbers that come out are the same.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
from typing import Any

from llvmlite import binding as llvm
from llvmlite import ir
from numba import njit
from numba.core import cgutils, datamodel, event, types, typing
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.dispatcher import _FunctionCompiler  # type: ignore[attr-defined]
from numba.core.imputils import impl_ret_borrowed, lower_cast, lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr

LARGE = 60  # LLVM's instructions; it decides by itself whether to call what is smaller


class Shared(types.Type):
    """numba's type of the place of a named tuple that a caller holds."""

    def __init__(self, whole: Any) -> None:
        """The type of that named tuple."""
        self.whole = whole
        fields = hashlib.sha256(repr((whole, whole.fields)).encode()).hexdigest()[:12]
        super().__init__(f"{whole.instance_class.__name__}-{fields}")  # in the names of all kernels

    @property
    def key(self) -> Any:
        """What makes it the same type as another."""
        return self.whole, self.whole.fields


def _shared(kind: Any) -> Any:
    """The type of an argument as kernels get it from kernels."""
    return Shared(kind) if isinstance(kind, types.BaseNamedTuple) else kind


@datamodel.register_default(Shared)
class _Pointer(datamodel.models.PrimitiveModel):
    """How LLVM sees a place."""

    def __init__(self, manager: Any, kind: Any) -> None:
        """A pointer to the values of all fields."""
        super().__init__(manager, kind, manager.lookup(kind.whole).get_value_type().as_pointer())


@infer_getattr
class _Fields(AttributeTemplate):
    """The types of fields."""

    key = Shared

    def generic_resolve(self, kind: Any, field: str) -> Any:  # type: ignore[override]
        """A named tuple inside stays where it is."""
        if field not in kind.whole.fields:
            return None
        return _shared(kind.whole.types[kind.whole.fields.index(field)])


@lower_getattr_generic(Shared)
def _read(context: Any, builder: Any, kind: Any, place: Any, field: str) -> Any:
    """Read a field."""
    index = kind.whole.fields.index(field)
    found, at = kind.whole.types[index], cgutils.gep_inbounds(builder, place, 0, index)
    if isinstance(found, types.BaseNamedTuple):
        return at
    return impl_ret_borrowed(context, builder, found, builder.load(at))


@lower_cast(types.BaseNamedTuple, Shared)
def _share(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    """Put a named tuple where a kernel that is called can read it."""
    return cgutils.alloca_once_value(builder, value)


class _Unfinished(JITCodeLibrary):
    """Code that is linked into what calls it, and only there made fast and into machine code."""

    def add_ir_module(self, module: Any) -> None:
        """Nobody writes to the places of named tuples: no need to read there twice."""
        for function in module.functions:
            for argument in function.args:
                kind = argument.type
                place = isinstance(kind, ir.PointerType) and isinstance(kind.pointee, ir.Aggregate)
                if place and argument.name.startswith("arg.") and not function.is_declaration:
                    argument.add_attribute("noalias")
        super().add_ir_module(module)

    def _optimize_functions(self, module: Any) -> None:
        """Simplify each function, and mark large ones."""
        super()._optimize_functions(module)
        for function in module.functions:
            if sum(1 for block in function.blocks for _ in block.instructions) > LARGE:
                function.add_function_attribute("noinline")

    def finalize(self) -> None:
        """Take in what the function calls, and leave it at that."""
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._final_module.verify()
        self._finalized = True


class _Finished(JITCodeLibrary):
    """Code for Python: a call, and what takes arguments out of Python's objects."""

    def _optimize_functions(self, module: Any) -> None:
        """Leave that to the passes over all of it, which begin with the same."""
        module.data_layout = self._codegen._data_layout


class _Finishing(Compiler):
    """numba's own steps."""

    def __init__(self, typing_context: Any, target_context: Any, library: Any, *rest: Any) -> None:
        """The code is finished here."""
        library = _Finished(target_context.codegen(), "kernel")
        library.enable_object_caching()  # as numba does, so that it can be kept
        super().__init__(typing_context, target_context, library, *rest)


class _Translation(Compiler):
    """numba's own steps, without the last."""

    def __init__(self, typing_context: Any, target_context: Any, library: Any, *rest: Any) -> None:
        """The code is not to be finished."""
        library = _Unfinished(target_context.codegen(), "inner kernel")
        super().__init__(typing_context, target_context, library, *rest)


class _Translator(_FunctionCompiler):
    """numba's compiler for a function that Python does not call."""

    def _customize_flags(self, flags: Any) -> Any:
        """No machine code, and nothing that Python or C could call."""
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        return flags


class _InnerKernel:
    """What numba asks of a compiled function when another calls it."""

    def __init__(self, compiled: Any) -> None:
        """Nothing is translated yet."""
        self.compiled = compiled
        self.translator = _Translator(
            compiled.py_func, compiled.targetdescr, compiled.targetoptions, {}, _Translation
        )
        self.results: dict[tuple[Any, ...], Any] = {}

    def get_call_template(self, args: Any, kws: Any) -> tuple[Any, Any, Any, Any]:
        """Translate for these types, if that is not done, and say what comes out.

        Raises:
            TypeError: if the code needs Python objects, which nothing would hand to it.
        """
        signature, folded = self.translator.fold_argument_types(args, kws)
        kinds = tuple(map(_shared, folded))
        if kinds not in self.results:
            about = {"dispatcher": self.compiled, "args": kinds, "return_type": None}
            with event.trigger_event("numba:compile", data=about):
                result = self.translator.compile(kinds, None)
            if result.environment.consts:
                raise TypeError(f"{self.compiled.__name__} keeps Python objects, as no kernel may")
            result = result._replace(entry_point=object())  # by which numba finds the code
            result.target_context.insert_user_function(
                result.entry_point, result.fndesc, [result.library]
            )
            self.results[kinds] = result
        name = self.compiled.__name__
        known = [result.signature for result in self.results.values()]
        template = typing.make_concrete_template(name, key=name, signatures=known)
        return template, signature, kinds, {}

    def get_overload(self, args: Any) -> Any:
        """By what numba finds the code for these types."""
        return self.results[tuple(args)].entry_point


def compiled_for_python(function: Any, options: dict[str, Any]) -> Any:
    """A compiled function for Python; other kernels that name it get its inner kernel.

    Args:
        function: a Python function.
        options: numba's.

    Returns:
        numba's dispatcher, or the function itself where the compiler is switched off.
    """
    whole: Any = njit(**options)(function)
    if whole is function:
        return function
    inner = _InnerKernel(whole)
    for_python: dict[str, Any] = {**options, "no_cfunc_wrapper": True}
    compiled: Any = njit(pipeline_class=_Finishing, **for_python)(_only_calling(function, whole))
    for one in (whole, compiled):
        one.get_call_template, one.get_overload = inner.get_call_template, inner.get_overload
    functools.update_wrapper(compiled, function)
    compiled.py_func, compiled.targetoptions = function, whole.targetoptions
    return compiled


def without_bitcode(library: Any) -> None:
    """Let a finished library be kept as machine code alone: no kernel is linked with it.

    With it, numba would keep LLVM's code, and parse that each time for the names of functions.
    """
    names = (f.name for f in library._final_module.functions if not f.is_declaration)
    text = "".join(f'define void @"{name}"() {{ ret void }}\n' for name in names)
    library._shared_module = llvm.parse_assembly(text)


def _only_calling(function: Any, called: Any) -> Any:
    """A function of the same name, arguments and defaults, which only calls that."""
    names = ", ".join(inspect.signature(function).parameters)
    place: dict[str, Any] = {"__name__": function.__module__, "called": called}
    name = function.__name__ if function.__name__.isidentifier() else "unnamed"
    exec(f"def {name}({names}):\n    return called({names})\n", place)
    made = place[name]
    made.__defaults__, made.__qualname__ = function.__defaults__, function.__qualname__
    return made
