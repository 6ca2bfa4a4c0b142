"""Reading by foreign libraries, in a child process with limits on time and memory.

A damaged file may end the process that reads it, keep it for ever or fill the memory: the libraries of binary formats
trust what they read. So they read in a child, which the files of a command share one after the other; what befalls it
is a fault of the file, and the next file gets another child.
"""

from __future__ import annotations

import atexit
import os
import pickle
import re
import signal
import subprocess
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from threading import Lock, Timer
from types import ModuleType, SimpleNamespace
from typing import IO, Any, cast

from pzd.parallel.processes import own_python
from pzd.schema.errors import ConfigError, DataError, FilesError, UserError, at

_MEGABYTE, _GIGABYTE = 1e6, 1e9
_SECONDS, _SECONDS_A_MEGABYTE = 4.0, 30.0
"""Computing time that a file may take, and more by its size [s]: ten times what a workbook takes, the slowest."""
_PATIENCE, _PATIENCE_A_SECOND = 60.0, 2.0
"""Time on the clock [s], and more by the computing time, until a child is ended that waits, or computes unlimited."""
_MEMORY, _MEMORY_A_BYTE = 1e9, 50.0
"""Memory that reading a file may take, and more by its size [bytes]: a cell of a workbook takes some 100 bytes."""
_ADVICE = "export it again, or save its columns as CSV"
_ERRORS: dict[str, type[UserError]] = {kind.__name__: kind for kind in (ConfigError, DataError, FilesError)}


# --- The parent ---


class _Child:
    """A process that reads files one after the other."""

    def __init__(self) -> None:
        self.owner = os.getpid()
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  # closed by `end`
        self._process = subprocess.Popen(  # noqa: S603  # our own module
            own_python("from pzd.rig.files.child import serve; serve()"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )

    def ask(self, request: tuple[Any, ...], seconds: float) -> Any:
        """Have the child do something.

        Raises
        ------
        EOFError, OSError, UnpicklingError : when it has ended, or was ended as it took so many seconds
        """
        stdin, stdout = cast("IO[bytes]", self._process.stdin), cast("IO[bytes]", self._process.stdout)
        timer = Timer(seconds, self._process.kill)
        timer.daemon = True
        timer.start()
        try:
            pickle.dump(request, stdin)
            stdin.flush()
            return pickle.load(stdout)  # noqa: S301  # of our own process
        finally:
            timer.cancel()

    def end(self) -> int:
        """End the process; return its exit code, below 0 that of a signal."""
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        try:
            code = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        self._errors.close()
        return code

    def said(self) -> str:
        """Return the last of what the process wrote to stderr."""
        self._errors.seek(0)
        lines = self._errors.read().decode("utf-8", "replace").split("\n")
        return " ".join(line for line in lines[-2:] if line)


_child: _Child | None = None
_one_at_a_time = Lock()


def end_child() -> None:
    """End the process that reads, as no more files follow."""
    global _child  # one a process
    child, _child = _child, None
    if child is not None and child.owner == os.getpid():
        child.end()


atexit.register(end_child)


def read_in_child(path: Path, module: ModuleType, what: str, *arguments: Any) -> Any:
    """Call a function of a format with a file, in the child.

    Parameters
    ----------
    path : the file
    module : the format
    what : name of its function
    arguments : of the function, behind the path

    Raises
    ------
    UserError : as the function does
    DataError : when the file cannot be read, ends the child, or takes too much time or memory
    """
    global _child  # noqa: PLW0603  # one a process
    with _one_at_a_time:
        if _child is None or _child.owner != os.getpid():
            _child = _Child()
            try:
                _child.ask(("hello",), _PATIENCE)
            except (EOFError, OSError, pickle.UnpicklingError):
                said = _child.said()
                end_child()
                raise RuntimeError(f"the process that reads files did not start ({said})") from None
        size = path.stat().st_size if path.exists() else 0
        limits = _Limits(
            _SECONDS + _SECONDS_A_MEGABYTE * size / _MEGABYTE, min(_MEMORY + _MEMORY_A_BYTE * size, _installed())
        )
        begun = time.monotonic()
        try:
            outcome, *found = _child.ask(
                (Path.cwd(), path, module.__name__, what, arguments, limits), _patience(limits)
            )
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            child, _child = _child, None
            code = child.end()
            raise DataError(f"{at(path)}: {_end(code, module.KIND, limits, time.monotonic() - begun)}") from error
        except BaseException:  # interrupted, with half of an answer in the pipe
            end_child()
            raise
        if outcome == "memory":
            end_child()
            raise DataError(f"{at(path)}: {_out_of_memory(module.KIND, limits)}")
    if outcome == "refused":
        kind, messages = found
        raise _ERRORS[kind](messages)
    return found[0]


@dataclass(frozen=True)
class _Limits:
    """What reading a file may take."""

    seconds: float
    """Computing time [s]."""
    memory: float
    """[bytes]."""


def _patience(limits: _Limits) -> float:
    """Time on the clock after which a child is ended [s]."""
    return _PATIENCE + _PATIENCE_A_SECOND * limits.seconds


def _end(code: int, kind: str, limits: _Limits, took: float) -> str:
    """Say why the child ended."""
    if took >= _patience(limits) or code == -getattr(signal, "SIGXCPU", 0):
        return f"{kind} that is not read after {took:.0f} s: it is damaged; {_ADVICE}"
    if code == -getattr(signal, "SIGKILL", 0):
        return f"{kind} whose reading the system ended, perhaps for want of memory; {_ADVICE}"
    how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
    return f"{kind} that crashes its library ({how}): it is damaged; {_ADVICE}"


def _out_of_memory(kind: str, limits: _Limits) -> str:
    return (
        f"{kind} that takes more than {limits.memory / _GIGABYTE:.1f} GB of memory to read: it is damaged, "
        f"or holds far more than a recording; {_ADVICE}"
    )


def _installed() -> float:
    """Memory of this machine [bytes]."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return float("inf")


# --- The child ---


def serve() -> None:
    """Read files as asked on standard input, until it ends."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    asked, answers = (os.fdopen(os.dup(stream), mode) for stream, mode in ((0, "rb"), (1, "wb")))
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1):  # some libraries print what they stumble over
        os.dup2(nowhere, stream)
    while True:
        try:
            request = pickle.load(asked)  # noqa: S301  # of our parent
        except EOFError:
            return
        answer = ("hello",) if request == ("hello",) else _read(*request)
        pickle.dump(answer, answers, pickle.HIGHEST_PROTOCOL)
        answers.flush()


def _read(
    folder: str, path: Path, name: str, what: str, arguments: tuple[Any, ...], limits: _Limits
) -> tuple[Any, ...]:
    """Read a file: "read" and what is in it, "refused" and why, or "memory"."""
    from pzd.rig.files.formats import by_library

    os.chdir(folder)
    module = import_module(name)
    if module.NEEDS is not None:  # its import is not counted
        import_module(module.NEEDS)
    with _limited(limits):
        try:
            return "read", by_library(path, module, lambda: getattr(module, what)(path, *arguments))
        except UserError as error:
            # A refusal by the library names its reason, if need be one of memory, in its own words.
            if _FOR_MEMORY.search(str(error.__cause__)) or isinstance(error.__cause__, MemoryError):
                return ("memory",)
            return "refused", type(error).__name__, error.messages


_FOR_MEMORY = re.compile(r"\b(alloc\w*|(out|lack) of memory|malloc|realloc)\b", re.IGNORECASE)


class _limited:  # noqa: N801  # a context, as those of contextlib are written
    """Keep to limits, as far as the system has such."""

    def __init__(self, limits: _Limits) -> None:
        self.limits = limits

    def __enter__(self) -> None:
        with suppress(ImportError):
            import resource

            _lower(resource.RLIMIT_CORE, 0.0)
            usage = resource.getrusage(resource.RUSAGE_SELF)
            _lower(resource.RLIMIT_CPU, usage.ru_utime + usage.ru_stime + self.limits.seconds + 1.0)
            held = _held()
            if held is not None:
                _lower(resource.RLIMIT_DATA, held + self.limits.memory)

    def __exit__(self, *_: object) -> None:
        with suppress(ImportError):
            import resource

            for kind in (resource.RLIMIT_CPU, resource.RLIMIT_DATA):
                _lower(kind, float("inf"))


def _lower(kind: int, to: float) -> None:
    """Set a limit for now, as far as the system's own allows."""
    import resource

    hard = resource.getrlimit(kind)[1]
    most = float("inf") if hard == resource.RLIM_INFINITY else float(hard)
    soft = min(to, most)
    with suppress(OSError, ValueError):
        resource.setrlimit(kind, (resource.RLIM_INFINITY if soft == float("inf") else int(soft), hard))


def _held() -> float | None:
    """Memory that this process holds already and that counts, the system's libraries aside [bytes]."""
    with suppress(OSError):
        found = re.search(r"^VmData:\s*(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"), re.MULTILINE)
        return 1024.0 * float(found[1]) if found else None
    return None


def as_plain(options: tuple[str, ...], entry: object) -> SimpleNamespace:
    """Return an entry's options without its class, whose import takes longer than the child's start."""
    return SimpleNamespace(**{name: getattr(entry, name) for name in options})
