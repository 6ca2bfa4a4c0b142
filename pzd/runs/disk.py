"""What runs ask of the disk: hashes of files, writes that hold, refusals as one line, a lock; and versions."""

from __future__ import annotations

import hashlib
import os
import platform
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from pzd.schema.errors import FilesError

_SETTLED_NS = 100_000_000
"""Age from which a file's time of change tells one content from the next: file systems round it to about 10 ms."""
_LIBRARIES = ("pzd", "numpy", "scipy", "numba", "pandas", "pydantic")


def file_hash(path: Path) -> str:
    """SHA-256 of a file's content."""
    status = path.stat()
    if abs(time.time_ns() - status.st_mtime_ns) < _SETTLED_NS:
        return _hash(path)
    return _hash_as_of(path, status.st_mtime_ns, status.st_size, status.st_ino)


@cache
def _hash_as_of(path: Path, _changed: int, _size: int, _inode: int) -> str:
    """Return the hash of a file, computed once as long as the file system says that it is the same."""
    return _hash(path)


def _hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@cache
def versions() -> dict[str, str]:
    """Versions of Python, of pzd and of the libraries that its numbers depend on."""
    found = {"python": platform.python_version()}
    for name in _LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


@contextmanager
def as_files_error(place: Path) -> Iterator[None]:
    """Say what the disk refuses as one line."""
    try:
        yield
    except OSError as error:
        raise FilesError(f"{error.filename or place}: {error.strerror or error}") from error


def refuse_links(paths: Iterable[Path]) -> None:
    """Refuse to write where a link stands: it may lead anywhere, as in a run folder that somebody sent.

    Raises
    ------
    FilesError : naming every link
    """
    links = [path for path in paths if path.is_symlink()]
    if links:
        raise FilesError(
            f"{path}: this is a link (to {path.readlink()}), and results are not written through one; remove it"
            for path in links
        )


def refuse_links_below(folder: Path) -> None:
    """Refuse to write into a folder that is a link or holds one, at any depth.

    Raises
    ------
    FilesError : naming every link
    """
    refuse_links([folder])
    below = (Path(place) / name for place, folders, files in os.walk(folder) for name in (*folders, *files))
    refuse_links(below)


def write_afresh(path: Path, data: bytes) -> None:
    """Write a new file in place of what has the name, a link included, which is not followed."""
    path.unlink(missing_ok=True)
    with path.open("xb") as file:
        file.write(data)


def sync_folder(folder: Path) -> None:
    """Have the disk hold a folder and everything in it."""
    for path in folder.rglob("*"):
        sync(path)
    sync(folder)


def sync(path: Path) -> None:
    """Have the disk hold a file, or a folder's list of files where the system can sync one."""
    if path.is_dir() and os.name == "nt":
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


# --- One command at a time on a run: the lock on its folder

if TYPE_CHECKING:
    from filelock import BaseFileLock

_LOCK = ".lock"
_HOLDER = ".holder"
"""Who holds the lock, for the message to whoever waits."""
LOCK_TIMEOUT_S = 2.0
"""How long a command waits for another one on the same run: longer than `pzd check` or a run that is fresh takes."""
_RETRY_S = 0.01
"""How long to wait before a lock is tried again whose file another command has just taken away."""


@contextmanager
def locked(folder: Path, command: str) -> Iterator[None]:
    """Hold a run's folder, which is made where it is absent, and taken away again if it stays empty.

    Parameters
    ----------
    folder : the folder of the run
    command : what another command is told that has to wait

    Raises
    ------
    FilesError : when another command holds it, or the folder cannot be written or is a link
    """
    refuse_links((folder, folder / _LOCK))
    with as_files_error(folder):
        lock = _acquired(folder)
    try:
        with as_files_error(folder):
            write_afresh(folder / _HOLDER, _holder(command).encode())
        yield
    finally:
        with suppress(OSError):  # somebody may have removed the folder meanwhile
            (folder / _HOLDER).unlink(missing_ok=True)
            _remove_if_empty(folder)
        lock.release()


def _holder(command: str) -> str:
    started = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    return f"{command} (process {os.getpid()} on {platform.node()}, since {started})"


def _acquired(folder: Path) -> BaseFileLock:
    """Return the lock of a folder, held.

    A command whose first run comes to no result takes folder and lock file away while others wait for them;
    these try again on a new file, for a lock on a file that is no longer at its path excludes nobody.
    """
    from filelock import FileLock, Timeout

    deadline = time.monotonic() + LOCK_TIMEOUT_S
    while True:
        lock = FileLock(folder / _LOCK)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock.acquire(timeout=max(0.0, deadline - time.monotonic()))
            if _is_at_its_path(lock, folder / _LOCK):
                return lock
        except Timeout:
            raise _held(folder) from None
        except FileNotFoundError:
            if time.monotonic() > deadline:
                raise
        lock.release()
        time.sleep(_RETRY_S)


def _is_at_its_path(lock: BaseFileLock, path: Path) -> bool:
    handle = lock._context.lock_file_fd  # noqa: SLF001  # filelock has no public way to the file that it holds
    return handle is not None and os.path.samestat(os.fstat(handle), path.stat())


def _held(folder: Path) -> FilesError:
    who = "another command"
    with suppress(OSError):
        who = (folder / _HOLDER).read_text(encoding="utf-8") or who
    return FilesError(f"{folder}: {who} is writing here; wait for it, or give --runs another folder")


def _remove_if_empty(folder: Path) -> None:
    """Take a folder away again where a first run came to no result."""
    if [path.name for path in folder.iterdir()] == [_LOCK]:
        (folder / _LOCK).unlink()
        folder.rmdir()
        folder.parent.rmdir()
