"""Compiled functions, kept on disk for as long as no code of kernels changes.

`entry` is for functions that Python calls, and `kernel` for those that only these call, and each
other: called from Python, a `kernel` runs as plain, slow Python. What makes arrays is to be
`allocating_entry` or `allocating`: numba counts references to each array that a kernel reads out of
a `NamedTuple`, which one that makes no arrays and returns none does not need, because its caller
holds what it is given. numba refuses to compile one that should count.

A division by zero gives inf or NaN, which no comparison in the search accepts, where an exception
would end it.

numba keeps what it has compiled until the file of that function changes. What the function calls,
and the constants that it reads, may stand in other files; so kernels are kept here for as long as
all of `CODE` is as it was. And they are machine code, so that whoever could change one could run
anything: they are read only where they are as safe as the code beside them.
"""

from __future__ import annotations

import functools
import hashlib
import os
import stat
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import cfunc, njit
from numba.core import config
from numba.core.caching import InTreeCacheLocator, UserProvidedCacheLocator, UserWideCacheLocator
from numba.extending import register_jitable

HOOK = "CACHE_LOCATOR_CLASSES"  # numba's setting of where compiled functions are kept
ROOT = Path(__file__).resolve().parent
CODE = (
    "coverable_kernels.py",
    "robots/chain.py",
    "surfaces/triangle_kernel.py",
    "surfaces/meshes/*.py",
    "surfaces/meshes/cells/*.py",
    "surfaces/patches/closed_form_kernels.py",
    "feasibility/collisions/kernels/*.py",
    "feasibility/paper/*.py",
    "feasibility/roadmap/branch_and_bound/*.py",
    "feasibility/roadmap/causes/diagnosis.py",
    "feasibility/roadmap/cuts/findings.py",
    "feasibility/roadmap/motions/*.py",
    "feasibility/roadmap/moving_clear.py",
    "feasibility/timing/fastest_speeds.py",
    "feasibility/viewer/painter.py",
)
"""Files of kernels, of all that kernels name, and of the named tuples that they are given."""
Function = Any
KEPT_NOWHERE: set[str] = set()
"""Modules of this process whose kernels cannot be written to any safe folder."""
_turn = threading.RLock()


@functools.cache
def stamp() -> bytes:
    """A hash of all that kernels can be compiled from."""
    files = sorted({path for pattern in CODE for path in ROOT.glob(pattern)})
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).digest()


def is_safe(found: os.stat_result, code: os.stat_result, user: int) -> bool:
    """May a file or folder be trusted like the code?

    It belongs to the user, to root, or to whom the code belongs; and nobody else may write there,
    but for a group that may write to the code as well.

    Args:
        found: its owner and permissions.
        code: those of the folder that the code is in.
        user: who runs it.

    Example:
        >>> here = os.stat(__file__)
        >>> is_safe(here, here, here.st_uid), is_safe(os.stat("/tmp"), here, here.st_uid)
        (True, False)
    """
    if found.st_uid not in (user, 0, code.st_uid) or found.st_mode & stat.S_IWOTH:
        return False
    same_group = code.st_mode & stat.S_IWGRP and found.st_gid == code.st_gid
    return bool(same_group) or not found.st_mode & stat.S_IWGRP


class _SafeFolder:
    """One of numba's places for kernels, where it is safe; its stamp is that of all the code."""

    get_cache_path: Callable[[], str]
    _py_file: str

    def get_source_stamp(self) -> bytes:
        """What a kept kernel is valid for."""
        return stamp()

    def ensure_cache_path(self) -> None:
        """Make the folder, for this user alone, and see who may write there.

        Raises:
            PermissionError: if that is somebody else; then numba asks the next place.
        """
        folder, code = Path(self.get_cache_path()), Path(self._py_file).parent
        folder.mkdir(parents=True, exist_ok=True, mode=0o755 if folder.parent == code else 0o700)
        super().ensure_cache_path()  # type: ignore[misc]
        reached = [folder, *(folder.glob("*.nb[ic]") if folder.stat().st_mode & 0o077 else ())]
        if not all(is_safe(path.stat(), code.stat(), os.geteuid()) for path in reached):
            raise PermissionError(f"others may write to kernels in {folder}")


class Chosen(_SafeFolder, UserProvidedCacheLocator):
    """In `NUMBA_CACHE_DIR`, where that is set."""


class BesideCode(_SafeFolder, InTreeCacheLocator):
    """In `__pycache__`."""


class InHome(_SafeFolder, UserWideCacheLocator):
    """In the cache of the home folder, if there is one."""

    def ensure_cache_path(self) -> None:
        """See above."""
        if not Path(self.get_cache_path()).is_absolute():
            raise PermissionError("there is no home folder")
        super().ensure_cache_path()


def _kept(compiling: Callable[..., Any], function: Function) -> Any:
    """Let numba compile a function, and keep it in a safe place, unless the user chose others."""
    with _turn:
        chosen: str = getattr(config, HOOK)
        ours = ",".join(f"{__name__}.{place.__name__}" for place in (Chosen, BesideCode, InHome))
        setattr(config, HOOK, chosen or ours)
        try:
            return compiling(cache=True)(function)
        except RuntimeError:  # there is no such place
            KEPT_NOWHERE.add(function.__module__)
            return compiling()(function)
        finally:
            setattr(config, HOOK, chosen)


_COUNTED: dict[str, Any] = {"error_model": "numpy", "_nrt": True, "no_cfunc_wrapper": True}
_UNCOUNTED: dict[str, Any] = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
Decorator = Callable[[Function], Any]
kernel: Decorator = register_jitable(**_UNCOUNTED)
allocating: Decorator = register_jitable(**_COUNTED)
entry: Decorator = functools.partial(_kept, functools.partial(njit, **_UNCOUNTED))
allocating_entry: Decorator = functools.partial(_kept, functools.partial(njit, **_COUNTED))


def callback(signature: Any) -> Decorator:
    """For functions that kernels call by their address."""
    return functools.partial(_kept, functools.partial(cfunc, signature, error_model="numpy"))


@kernel
def put(target, source):  # type: ignore[no-untyped-def]
    """Copy numbers into an array of the same length; numba's `target[:] = source` is far longer."""
    for j in range(target.shape[0]):
        target[j] = source[j]
