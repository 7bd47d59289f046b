"""Compiled functions, kept on disk for as long as no code of kernels changes.

`entry` is for functions that Python calls, and `kernel` for those that only these call: called
from Python, one runs as plain, slow Python. `inlined` ones are written into their callers: a call
hands on every number of a named tuple of arrays. So are `spliced` ones, but before these are
compiled, and never by themselves: what calls much takes as long to compile as its callers. What
makes arrays is `allocating_entry` or `allocating`: numba counts references there, and refuses to
compile what should count and does not. A division by zero gives inf or NaN, which no comparison in
the search accepts.

Kernels are kept while all of `CODE` is as it was, as what a function calls may stand elsewhere.
Their folder bears its stamp: numba loads the classes that a kernel is given before it compares
stamps, and fails where one has moved. And as they are machine code, their folder is this user's
alone, and nobody else can put another in its place.
"""

import hashlib
import os
import shutil
import stat
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from numba import cfunc, config, njit
from numba.core.caching import InTreeCacheLocator
from numba.core.compiler_lock import global_compiler_lock
from numba.extending import register_jitable

ROOT = Path(__file__).resolve().parents[1]
CODE = (  # files of kernels, of all that they name, and of the named tuples that they are given
    "coverable/kernels.py", "robots/chain.py", "surfaces/triangle_kernel.py",
    "surfaces/meshes/*.py", "surfaces/meshes/cells/*.py", "surfaces/patches/closed_form_kernels.py",
    "feasibility/paper/*.py", "feasibility/collisions/kernels/*.py",
    "feasibility/roadmap/proofs/box*.py", "feasibility/roadmap/proofs/branching.py",
    "feasibility/roadmap/proofs/ruling.py", "feasibility/roadmap/causes/diagnosis.py",
    "feasibility/roadmap/moving_clear.py",
    "feasibility/roadmap/motions/*.py", "feasibility/timing/timed_curve.py",
    "feasibility/viewer/painter.py",
)  # fmt: skip
_FILES = (path for code in CODE for path in sorted(ROOT.glob(code)))
_STAMP = hashlib.sha256(b"".join(path.read_bytes() for path in _FILES)).hexdigest()[:16]
HOOK, _SETTINGS = "CACHE_LOCATOR_CLASSES", vars(config)  # of numba, from 0.62 on


def is_safe(found: os.stat_result, code: os.stat_result, user: int) -> bool:
    """Can only those who can change the code put something else in the place of a folder's files?

    It belongs to the user, to root, or to whom the code belongs; nobody else may write there, but
    for a group that may write to the code too; or nobody may change what is another's, as in /tmp.
    `found` is of the folder.
    """
    same_group = code.st_mode & stat.S_IWGRP and found.st_gid == code.st_gid
    others = stat.S_IWOTH if same_group else stat.S_IWOTH | stat.S_IWGRP
    written = found.st_mode & others and not found.st_mode & stat.S_ISVTX
    return found.st_uid in (user, 0, code.st_uid) and not written


def _made(place: str) -> Path | None:
    """The folder for the kernels of this code in a place, free of others; None where not safe."""
    folder, user = Path(place).resolve() / "coverable-kernels", os.geteuid()
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        own, code = folder.lstat(), ROOT.stat()
        safe = all(is_safe(parent.stat(), code, user) for parent in folder.parents)
    except OSError:
        return None
    alone = stat.S_ISDIR(own.st_mode) and own.st_uid == user and not own.st_mode & 0o077
    if not (safe and alone and os.access(folder, os.W_OK)):
        return None
    for other in set(folder.iterdir()) - {folder / _STAMP}:
        shutil.rmtree(other, ignore_errors=True)
    return folder / _STAMP


_HOME = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
_BESIDE = f"{ROOT}/coverable/__pycache__"
_PLACES = _SETTINGS["CACHE_DIR"], _BESIDE, _HOME if os.path.isabs(_HOME) else ""
FOLDER = next(filter(None, (_made(place) for place in _PLACES if place)), None)
"""Of all kernels: in `NUMBA_CACHE_DIR`, beside the code, or in the home folder's cache; or none."""


class Kept(InTreeCacheLocator):
    """Where numba keeps a function, and for how long."""

    def get_cache_path(self) -> str:
        """A folder for each folder of code, wherever that is."""
        inside = os.path.relpath(os.path.dirname(self._py_file), ROOT)
        return f"{FOLDER}/{inside.replace(os.sep, '-').replace('..', 'up')}"

    def get_source_stamp(self) -> bytes:
        """Its own file: all others that it is compiled from have their stamp in the folder."""
        return hashlib.sha256(Path(self._py_file).read_bytes()).digest()


@global_compiler_lock
def _kept(compiling: Callable[..., Any], function: Any) -> Any:
    """Let numba compile a function, and keep it where it can: a disk may be full by then."""
    usual, _SETTINGS[HOOK] = _SETTINGS[HOOK], f"{__name__}.Kept"
    try:
        kept = compiling(cache=FOLDER is not None)(function)
    except (OSError, RuntimeError):
        return compiling()(function)
    finally:
        _SETTINGS[HOOK] = usual
    compile_and_keep: Any = getattr(kept, "compile", None)  # none with NUMBA_DISABLE_JIT

    def compile_or_load(signature: Any) -> Any:
        with suppress(OSError):
            return compile_and_keep(signature)
        return compile_and_keep(signature)  # it was compiled, and could not be kept

    kept.compile = compile_or_load
    return kept


_COUNTED: dict[str, Any] = {"error_model": "numpy", "_nrt": True, "no_cfunc_wrapper": True}
_UNCOUNTED = _COUNTED | {"_nrt": False}
kernel: Callable[[Any], Any] = register_jitable(**_UNCOUNTED)
inlined: Callable[[Any], Any] = register_jitable(**_UNCOUNTED, forceinline=True)
spliced: Callable[[Any], Any] = partial(njit, **_UNCOUNTED, inline="always")
allocating: Callable[[Any], Any] = register_jitable(**_COUNTED)
entry: Callable[[Any], Any] = partial(_kept, partial(njit, **_UNCOUNTED))
allocating_entry: Callable[[Any], Any] = partial(_kept, partial(njit, **_COUNTED))


def callback(signature: Any) -> Callable[[Any], Any]:
    """For functions that kernels call by their address."""
    return partial(_kept, partial(cfunc, signature, error_model="numpy"))
