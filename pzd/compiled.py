"""Compilation of kernels and laws by numba, cached by the sources of all laws.

Numba keys a cached kernel by the file of the outermost function alone, so an edited law would
leave a stale kernel behind. The cache folder therefore carries a hash of every source of the
damper, of the laws of the blind benchmark, of every module that compiles, and of the versions:
edit a law, and the kernels are new. What stands in the cache is executed, so a folder counts only where no other user
can have written to it, and what is damaged there is compiled anew.
"""

from __future__ import annotations

import atexit
import gc
import hashlib
import logging
import os
import platform
import shutil
import stat
import sys
import tempfile
import zlib
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from pickle import loads
from types import FunctionType
from typing import Any, NoReturn, ParamSpec, TypeVar, cast

import numba
import numpy as np
from llvmlite.binding import parse_bitcode  # type: ignore[import-untyped]  # numba has no types either
from numba import types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.serialize import dumps
from numba.extending import typeof_impl

from pzd.own_effects import own_files
from pzd.schema.errors import FilesError

log = logging.getLogger(__name__)

P = ParamSpec("P")
R = TypeVar("R")


def sources() -> list[Path]:
    """Return every module with laws (damper, user, blind benchmark), and every other one that compiles."""
    package = Path(__file__).parent
    others = (path for path in package.rglob("*.py") if b"pzd.compiled import" in path.read_bytes())
    laws = (path for folder in ("damper", "blind/independent") for path in (package / folder).rglob("*.py"))
    return sorted({Path(__file__), *laws, *own_files(), *others})


PLACE = "PZD_CACHE"
"""Environment variable that names another folder for the compiled kernels."""
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def cache_folder() -> Path:
    """Return the folder of compiled kernels, which belongs to this user and which no other can write to.

    It stands in the folder that `PZD_CACHE` names, else in the user's cache, else in the temporary folder. Where none
    of these will do, it is a fresh one that ends with the process; those that the process starts find it too.

    Raises
    ------
    FilesError : when no folder can be made
    """
    digest = hashlib.sha256()
    for part in (sys.version, platform.machine(), numba.__version__, np.__version__):
        digest.update(part.encode())
    for source in sources():
        digest.update(source.read_bytes())
    name = digest.hexdigest()[:16]
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # noqa: PTH111  # Path's may raise
    user = f"-{os.geteuid()}" if hasattr(os, "geteuid") else ""
    places = [Path(home) / "pzd", Path(tempfile.gettempdir()) / f"pzd{user}"]
    if os.environ.get(PLACE):
        places.insert(0, Path(os.environ[PLACE]))
    found = (_kept(place, name) for place in places if place.is_absolute())  # it is not where nobody's home is known
    return next((folder for folder in found if folder is not None), None) or _passing(name)


def _kept(place: Path, name: str) -> Path | None:
    """Return a folder of this user in another one of theirs, both made where absent; None where that cannot be."""
    folder = place / name
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        above = place.parent.stat().st_mode
        if hasattr(os, "geteuid") and above & stat.S_IWOTH and not above & stat.S_ISVTX:
            return None  # anybody could put another folder in the place of ours
        for one in (place, folder):
            with suppress(FileExistsError):
                one.mkdir(mode=0o700)
            if not _is_mine(one):
                return None
            if one is place and one.stat().st_mode & _OTHERS_WRITE:
                one.chmod(0o700)  # a umask of 002 made it so; what stands in it is looked at by itself
        return folder if os.access(folder, os.W_OK) and not _writable_by_others(folder) else None
    except OSError:
        return None


def _is_mine(folder: Path) -> bool:
    """Whether a path, and the folder that it leads to, belong to this user."""
    if not hasattr(os, "geteuid"):  # without owners
        return folder.is_dir()
    owners = {folder.lstat().st_uid, folder.stat().st_uid}
    return folder.is_dir() and owners == {os.geteuid()}


def _writable_by_others(folder: Path) -> bool:
    return hasattr(os, "geteuid") and bool(folder.stat().st_mode & _OTHERS_WRITE)


@cache
def _passing(name: str) -> Path:
    """Return a folder of this process and of those that it starts."""
    try:
        place = Path(tempfile.mkdtemp(prefix="pzd-"))  # of this user alone, by Python's promise
        (place / name).mkdir(mode=0o700)
    except OSError as error:
        refuse_cache(Path(tempfile.gettempdir()), error)
    log.warning(
        "compiled kernels are not kept for the next command: no folder for them belongs to you alone; set %s to one",
        PLACE,
    )
    os.environ[PLACE] = str(place)
    maker = os.getpid()
    atexit.register(lambda: shutil.rmtree(place, ignore_errors=True) if os.getpid() == maker else None)
    return place / name


def refuse_cache(place: Path, error: OSError) -> NoReturn:
    """Say that the cache cannot be written.

    Raises
    ------
    FilesError : naming it
    """
    raise FilesError(
        f"{place}: the cache of compiled kernels cannot be written ({error.strerror or error}); "
        f"make room there, or set {PLACE} to another folder"
    ) from error


numba.config.CACHE_DIR = str(cache_folder())  # type: ignore[attr-defined]  # numba sets its options up at run time


class _Checked(IndexDataCacheFile):
    """Entries of numba's cache, each with a checksum: a damaged one may read well and run wild."""

    def save(self, key: Any, data: Any) -> None:
        """Save an entry with its key and checksum."""
        sealed = dumps((key, data))
        super().save(key, (zlib.crc32(sealed), sealed))

    def load(self, key: Any) -> Any:
        """Load an entry, None where there is none.

        Raises
        ------
        ValueError : when it is not what was saved
        """
        found = super().load(key)
        if found is None:
            return None
        checksum, sealed = found
        if zlib.crc32(sealed) != checksum:
            raise ValueError("the entry is damaged")
        saved_as, data = loads(sealed)  # noqa: S301  # from a folder of this user
        if saved_as != key:
            raise ValueError("the entry is another one's")
        return data


class _Cache(FunctionCache):
    """Numba's cache of a function, without which everything is computed all the same."""

    def __init__(self, function: FunctionType) -> None:
        super().__init__(function)
        locator = self._impl.locator
        self._cache_file = _Checked(self._cache_path, self._impl.filename_base, locator.get_source_stamp())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load a kernel; None where there is none, or one that is damaged, which is then compiled anew."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:  # noqa: BLE001  # damaged pickles raise anything
            log.debug("%s: compiled anew (%s)", self._cache_file._index_path, error)  # noqa: SLF001  # numba's name
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save a kernel, unless the disk refuses."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _warn_of_cache(error.strerror or str(error))


class _Bitcode(JITCodeLibrary):
    """The code of a function that compiled functions alone call: bitcode, which becomes machine code in its callers.

    By itself numba optimises each function together with all that it calls, and makes machine code of it that nobody
    runs: at each level of calls everything below is done again, which takes most of the time of compiling.
    """

    def finalize(self) -> None:
        """Take in the functions that are called, as they are."""
        for library in dict.fromkeys(self._linking_libraries):
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)  # noqa: SLF001  # numba's name
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return numba's sign that there is no machine code."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> _NoEnvironment:
        """What numba gives the environment to, which machine code would need."""
        return _NoEnvironment()

    def serialize_using_object_code(self) -> tuple[str, bytes]:
        """Return what `rebuilt` takes."""
        return self.name, self._get_module_for_linking().as_bitcode()

    @classmethod
    def rebuilt(cls, codegen: Any, saved: tuple[str, bytes]) -> _Bitcode:
        """Return bitcode as it was saved."""
        library = cls(codegen, saved[0])
        library._final_module = library._shared_module = parse_bitcode(saved[1])
        library._finalized = True
        return library


class _NoEnvironment:
    """Stands where numba sets the environment of machine code."""

    def set_env(self, name: str, environment: object) -> None:
        """Set nothing."""


class _BitcodeCompiler(Compiler):
    """Numba's compiler, which makes bitcode alone."""

    def define_pipelines(self) -> Any:
        """Return numba's own pipeline."""
        self.state.library = _Bitcode(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super().define_pipelines()


class _BitcodeCacheImpl(CompileResultCacheImpl):
    """How bitcode is saved."""

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Return the result of a compilation as it was saved; see `CompileResult._reduce`."""
        saved, fndesc, environment, signature, objectmode, lifted, annotation, reload_init, _ = payload
        library = _Bitcode.rebuilt(target_context.codegen(), saved)
        return CompileResult(  # type: ignore[call-arg]  # numba has no types
            typing_context=target_context.typing_context,
            target_context=target_context,
            entry_point=target_context.get_executable(library, fndesc, environment),
            typing_error=None,
            type_annotation=annotation,
            signature=signature,
            objectmode=objectmode,
            lifted=lifted,
            fndesc=fndesc,
            library=library,
            call_helper=None,
            environment=environment,
            metadata=None,
            reload_init=reload_init,
            referenced_envs=(),
        )


class _BitcodeCache(_Cache):
    """The cache of functions that are bitcode alone."""

    _impl_class = _BitcodeCacheImpl  # type: ignore[assignment]  # numba has no types


@cache
def _warn_of_cache(why: str) -> None:
    """Say once that kernels cannot be kept."""
    log.warning(
        "%s: the cache of compiled kernels cannot be written (%s), so each command compiles anew; make room there, "
        "or set %s to another folder",
        numba.config.CACHE_DIR,  # type: ignore[attr-defined]  # numba sets its options up at run time
        why,
        PLACE,
    )


_OPTIONS: dict[str, Any] = {
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
        self.inner = _dispatcher(inner, _BitcodeCache, no_cpython_wrapper=True, pipeline_class=_BitcodeCompiler)

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


def _dispatcher(function: FunctionType, kept: type[_Cache] = _Cache, **options: Any) -> Any:
    """Return numba's dispatcher of a function, which compiles in one process at a time.

    Where several processes begin on an empty cache, each kernel is compiled by the first that needs it while the others
    wait and then read it. numba has no lock of its own, and its events come too late to look into the cache once more;
    so `compile` is wrapped.
    """
    dispatcher = numba.njit(function, **_OPTIONS, **options)
    if dispatcher is function:  # under NUMBA_DISABLE_JIT, for a debugger
        return function
    try:
        dispatcher._cache = kept(function)  # noqa: SLF001  # numba documents no way to give it another
    except (OSError, RuntimeError):  # numba's word for a folder that it cannot write to
        _warn_of_cache("numba cannot write there")
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
