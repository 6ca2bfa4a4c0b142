"""What runs ask of the disk: contents as hashes, writes that hold, refusals as one line; and versions."""

from __future__ import annotations

import hashlib
import os
import platform
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

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
    """The hash of a file, computed once as long as the file system says that it is the same."""
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
