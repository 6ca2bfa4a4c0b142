"""Arrays that lie in a file of the disk and not in memory, for more records than memory holds.

An array on disk is mapped: it is read where it is used, like any other, and its pages leave memory again where the work
on its record ends (`let_go`). The files have no names: they are gone with the process, however it ends.
"""

from __future__ import annotations

import mmap
import os
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar
from weakref import WeakSet

import numpy as np
from numpy.typing import NDArray

Held = TypeVar("Held")
Item = TypeVar("Item")

IN_MEMORY = 32_000_000
"""Bytes of one set of records that stay in memory [B]: fifty tests of 10^4 samples, which gain nothing on disk."""
_FILE = 64 * 1024 * 1024
"""Bytes of one file, which is given back as a whole once nobody has an array in it."""

_files: WeakSet[_Mapping] = WeakSet()
"""Those in which somebody has an array."""


class _Mapping(mmap.mmap):
    """A mapped file, told from what others map."""


class OnDisk:
    """A set of arrays of which those beyond `IN_MEMORY` go to disk."""

    def __init__(self, in_memory: int = IN_MEMORY) -> None:
        self._left = in_memory

    def kept(self, held: Held) -> Held:
        """Return a dataclass with its arrays, and those in its dictionaries, where they are to lie."""
        given: Any = held
        own = {field.name: getattr(given, field.name) for field in fields(given)}
        changed = {name: self._of_field(value) for name, value in own.items()}
        same = all(changed[name] is value for name, value in own.items())
        found: Held = given if same else replace(given, **changed)
        return found

    def _of_field(self, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return self._array(value)
        if isinstance(value, dict):
            return {key: self._of_field(one) for key, one in value.items()}
        return value

    def _array(self, values: Any) -> Any:
        if is_on_disk(values):
            return values
        self._left -= values.nbytes
        return values if self._left >= 0 else _written(values)


def is_on_disk(values: NDArray[Any]) -> bool:
    """Whether an array lies on disk."""
    base: Any = values
    while isinstance(base, np.ndarray):
        base = base.base
    return isinstance(base.obj if isinstance(base, memoryview) else base, _Mapping)


def beside(values: NDArray[Any], other: NDArray[Any]) -> NDArray[Any]:
    """Return an array on disk where another lies there: what is made of a record lies where the record does."""
    return _written(values) if is_on_disk(other) and not is_on_disk(values) else values


def let_go() -> None:
    """Let the pages of all arrays on disk leave the memory of this process; whoever reads on reads them again."""
    for file in _files:
        file.madvise(mmap.MADV_DONTNEED)


def one_at_a_time(items: Iterable[Item]) -> Iterator[Item]:
    """Yield items, and let go of the arrays on disk behind each."""
    for item in items:
        yield item
        let_go()


class _Writing:
    """The file that is being filled, by this process alone."""

    handle: int | None = None
    mapped: _Mapping | None = None
    used = 0
    process = 0


def _written(values: NDArray[Any]) -> NDArray[Any]:
    """Copy an array to disk; where the disk does not take it, or this system has no such files, it stays as it is."""
    if not values.size or not hasattr(mmap, "MADV_DONTNEED") or values.dtype.hasobject:
        return values
    data = np.ascontiguousarray(values)
    size = -(-data.nbytes // mmap.PAGESIZE) * mmap.PAGESIZE
    try:
        # A forked process would write where its parent goes on writing.
        if _Writing.mapped is None or _Writing.process != os.getpid() or _Writing.used + size > len(_Writing.mapped):
            _begin_file(max(size, _FILE))
        written = os.pwrite(_Writing.handle or 0, data.data.cast("B"), _Writing.used)
    except OSError:
        return values
    if written != data.nbytes or _Writing.mapped is None:
        return values
    found = np.frombuffer(_Writing.mapped, data.dtype, data.size, _Writing.used).reshape(data.shape)
    _Writing.used += size
    return found


def _begin_file(size: int) -> None:
    if _Writing.handle is not None:
        os.close(_Writing.handle)
    _Writing.handle = _Writing.mapped = None
    handle, path = tempfile.mkstemp(prefix="pzd-")
    Path(path).unlink()
    os.truncate(handle, size)
    _Writing.handle, _Writing.mapped, _Writing.used = handle, _Mapping(handle, size), 0
    _Writing.process = os.getpid()
    _files.add(_Writing.mapped)
