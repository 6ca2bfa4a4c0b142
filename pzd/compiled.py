"""Compiles the laws to machine code, and keeps what was compiled apart by the laws' sources.

Numba keys a cached kernel by the file of the outermost function alone, so an edited law would
leave a stale kernel behind. The cache folder therefore carries a hash of every source of the
damper, of the laws of the blind benchmark, of every module that compiles, and of the versions:
edit a law, and the kernels are new.
"""

from __future__ import annotations

import gc
import hashlib
import os
import platform
import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import cached_property
from pathlib import Path
from types import FunctionType
from typing import Any, ParamSpec, TypeVar, cast

import numba
import numpy as np
from numba.core.registry import CPUDispatcher

from pzd.own_effects import own_files

P = ParamSpec("P")
R = TypeVar("R")


def sources() -> list[Path]:
    """Every module with laws (the damper's, one's own, the blind benchmark's), and every other one that compiles."""
    package = Path(__file__).parent
    others = (path for path in package.rglob("*.py") if b"pzd.compiled import" in path.read_bytes())
    laws = (path for folder in ("damper", "blind/independent") for path in (package / folder).rglob("*.py"))
    return sorted({Path(__file__), *laws, *own_files(), *others})


def cache_folder() -> Path:
    """The folder of compiled kernels: in the user's cache, or a temporary one where that cannot be written."""
    digest = hashlib.sha256()
    for part in (sys.version, platform.machine(), numba.__version__, np.__version__):
        digest.update(part.encode())
    for source in sources():
        digest.update(source.read_bytes())
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # noqa: PTH111  # Path's may raise
    for root in (Path(home), Path(tempfile.gettempdir())):
        folder = root / "pzd" / digest.hexdigest()[:16]
        if not root.is_absolute():
            continue  # nobody's home is known
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return Path(tempfile.mkdtemp(prefix="pzd-"))


numba.config.CACHE_DIR = str(cache_folder())  # type: ignore[attr-defined]  # numba sets its options up at run time


_OPTIONS: dict[str, Any] = {
    "nopython": True,
    "error_model": "numpy",
    "nogil": True,
    "_nrt": False,  # no array is made inside, so none is counted, which took three quarters of a ride's time
    "no_cfunc_wrapper": True,  # nothing here is called from C, and the wrapper costs a tenth of the compiling
}


class _Kernel(CPUDispatcher):
    """A compiled function that Python calls; compiled callers take its `inner` twin.

    What reads the arguments of a call from Python costs a quarter of the compiling, and most functions are called by
    compiled ones alone: it is made for those that Python does call.
    """

    def __init__(self, function: Callable[..., Any], inline: str = "never") -> None:
        super().__init__(py_func=function, targetoptions={**_OPTIONS, "inline": inline})
        self.enable_caching()

    @cached_property
    def _inner(self) -> Any:
        function = self.py_func
        twin = FunctionType(
            function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
        )
        twin.__qualname__ = f"{function.__qualname__}.inner"  # by which numba keeps it
        inner = CPUDispatcher(py_func=twin, targetoptions={**_OPTIONS, "no_cpython_wrapper": True})
        inner.enable_caching()
        return inner

    def compile(self, sig: Any) -> Any:
        """Compile as numba does, once: another process that needs the same meanwhile waits, and reads it.

        No garbage is looked for in what is made, which would take an eighth of the time.
        """
        from filelock import FileLock

        lock = FileLock(Path(numba.config.CACHE_DIR) / f"{self.__module__}.{self.__qualname__}.lock")  # type: ignore[attr-defined]  # numba sets its options up at run time
        enabled = gc.isenabled()
        with ExitStack() as held:
            with suppress(OSError):  # without locks it is merely compiled twice
                held.enter_context(lock)
            gc.disable()
            if enabled:
                held.callback(gc.enable)
            return super().compile(sig)

    @property
    def _numba_type_(self) -> Any:
        """What a compiled caller finds where it names this function."""
        return self._inner._numba_type_


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """The same function as machine code, cached across processes, and with it the plain functions of pzd it calls.

    It fills the arrays that it is given and makes none of its own: one that does is not compiled. What a law calls
    may stand in a plain module, so that an effect can be named in a config without numba, which takes a quarter of a
    second to import.
    """
    for name in function.__code__.co_names:
        called = function.__globals__.get(name)
        if isinstance(called, FunctionType) and called.__module__.startswith("pzd."):
            function.__globals__[name] = compiled(called)
    return cast("Callable[P, R]", _Kernel(function))


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """The same, inlined into each compiled caller: for short functions that are called once or twice."""
    return cast("Callable[P, R]", _Kernel(function, inline="always"))
