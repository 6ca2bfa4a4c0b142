"""Compilation of kernels and laws by numba, cached by the sources of all laws.

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
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from types import FunctionType
from typing import Any, ParamSpec, TypeVar, cast

import numba
import numpy as np
from numba import types
from numba.extending import typeof_impl

from pzd.own_effects import own_files

P = ParamSpec("P")
R = TypeVar("R")


def sources() -> list[Path]:
    """Return every module with laws (damper, user, blind benchmark), and every other one that compiles."""
    package = Path(__file__).parent
    others = (path for path in package.rglob("*.py") if b"pzd.compiled import" in path.read_bytes())
    laws = (path for folder in ("damper", "blind/independent") for path in (package / folder).rglob("*.py"))
    return sorted({Path(__file__), *laws, *own_files(), *others})


def cache_folder() -> Path:
    """Return the folder of compiled kernels: in the user's cache, or a temporary one where that is not writable."""
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
    "cache": True,
    "error_model": "numpy",
    "nogil": True,
    "no_cfunc_wrapper": True,  # nothing here is called from C, and the wrapper costs a tenth of the compiling
    # The one undocumented option: no array is made inside, so no references are counted. Counting those of the arrays
    # that are passed on takes three quarters of a ride's time, and numba documents nothing that switches it off.
    "_nrt": False,
}


class Kernel:
    """A compiled function, which Python and other compiled functions call.

    Code that reads the arguments of a call from Python takes a quarter of the time to compile, and compiled functions
    call most functions alone. So there are two versions, each compiled where it is first called: `inner` without that
    code for compiled callers, to which numba resolves this object, and one with it for Python.
    """

    def __init__(self, function: FunctionType) -> None:
        update_wrapper(self, function)
        self._function = function
        inner = _copied(function, function.__globals__)
        inner.__qualname__ = f"{function.__qualname__}.inner"  # by which numba keeps it in its cache
        self.inner = _dispatcher(inner, no_cpython_wrapper=True)

    @cached_property
    def outer(self) -> Any:
        """The version for Python."""
        return _dispatcher(self._function)

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        return self.outer(*arguments)


@typeof_impl.register(Kernel)
def _type_of_kernel(kernel: Kernel, context: object) -> types.Dispatcher:
    """Return the numba type of a kernel that a compiled function names."""
    return types.Dispatcher(kernel.inner)


def _copied(function: FunctionType, names: dict[str, Any]) -> FunctionType:
    """Return a copy of a function that finds its global names elsewhere."""
    return FunctionType(function.__code__, names, function.__name__, function.__defaults__, function.__closure__)


def _dispatcher(function: FunctionType, **options: Any) -> Any:
    """Return numba's dispatcher of a function, which compiles in one process at a time.

    Where several processes begin on an empty cache, each kernel is compiled by the first that needs it while the others
    wait and then read it. numba has no lock of its own, and its events come too late to look into the cache once more;
    so `compile` is wrapped.
    """
    dispatcher = numba.njit(function, **_OPTIONS, **options)
    if dispatcher is function:  # under NUMBA_DISABLE_JIT, for a debugger
        return function
    compile_now = dispatcher.compile
    file_lock = Path(numba.config.CACHE_DIR) / f"{function.__module__}.{function.__qualname__}.lock"  # type: ignore[attr-defined]  # numba sets its options up at run time

    def compile_once(signature: Any) -> Any:
        from filelock import FileLock

        with ExitStack() as stack:
            with suppress(OSError):  # without locks it is merely compiled twice
                stack.enter_context(FileLock(file_lock))
            if gc.isenabled():  # looking for garbage in what is made takes an eighth of the time
                gc.disable()
                stack.callback(gc.enable)
            return compile_now(signature)

    dispatcher.compile = compile_once
    return dispatcher


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function to machine code, cached across processes.

    It fills the arrays that it is given and makes none of its own: numba refuses one that does.
    """
    return cast("Callable[P, R]", Kernel(cast("FunctionType", function)))


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function into each of its compiled callers: for short ones that are called once or twice."""
    return cast("Callable[P, R]", _dispatcher(cast("FunctionType", function), inline="always"))


@cache
def compiled_law(function: FunctionType) -> Callable[..., Any]:
    """Compile a plain function of an effect file, and with it the plain functions of pzd that it calls.

    Effect files are not decorated, so that an effect can be named in a config without numba, which takes a quarter of a
    second to import. The compiled law is a copy with globals of its own, and its file stays as it is.
    """
    named = {name: function.__globals__.get(name) for name in function.__code__.co_names}
    called = {
        name: compiled_law(value)
        for name, value in named.items()
        if isinstance(value, FunctionType) and value.__module__.startswith("pzd.")
    }
    return compiled(_copied(function, {**function.__globals__, **called}))
