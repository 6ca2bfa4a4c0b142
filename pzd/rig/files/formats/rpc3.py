"""RPC III time histories of road simulators and servo-hydraulic stands (.rsp, .drv): a table of all channels.

A head of records of 128 bytes, a name of 32 and a value of 96 characters, in blocks of 512 bytes; then groups, in each
the samples of one channel behind those of the other, whole numbers times `SCALE.CHAN_n` or numbers of 32 bits. The
clock is `time`, counted by `DELTA_T`.
Source: MTS Systems, RPC III file format.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pzd.rig.config import FilesEntry
from pzd.rig.files.sheet import Cells, FileTable, number
from pzd.schema.errors import DataError, at

KIND = "an RPC III file"
SUFFIXES = (".rsp", ".drv", ".rpc", ".rpc3")
NEEDS = None
OPTIONS = ("table",)
CLOCK = "time"
"""Header of the clock, which has no channel of its own."""
RECORD, NAME, BLOCK = 128, 32, 512
"""Bytes of a record of the head, of its name, and of a block."""
MOST_BLOCKS = 256
"""Blocks of the head at most: 1024 parameters."""
MOST_CHANNELS = 256
"""Channels of the format at most."""
_TYPES = {"SHORT_INTEGER": "i2", "FLOATING_POINT": "f4"}
_HISTORIES = ("TIME_HISTORY", "")
"""Kinds of files that are recordings over time; others hold spectra, matrices or histograms."""


def holds(path: Path, start: bytes) -> bool:
    """Whether a file is of this format, by its first bytes."""
    return start[:NAME].rstrip(b"\0 ") == b"FORMAT" and start[RECORD : RECORD + NAME].rstrip(b"\0 ").isupper()


def tables(path: Path, entry: FilesEntry) -> list[FileTable]:
    """Read the one table of the file.

    Raises
    ------
    DataError : when the head lacks something, is no head of a time history, or the data are cut off
    """
    raw = path.read_bytes()
    head = _head(path, raw)
    if head.get("FILE_TYPE", "") not in _HISTORIES:
        raise DataError(f"{at(path)}: {KIND} of {head['FILE_TYPE']}, which is no recording over time")
    channels, group = _whole(path, head, "CHANNELS", MOST_CHANNELS), _whole(path, head, "PTS_PER_GROUP", len(raw))
    points = _whole(path, head, "FRAMES", len(raw)) * _whole(path, head, "PTS_PER_FRAME", len(raw))
    kind = _TYPES.get(head.get("DATA_TYPE", "SHORT_INTEGER"))
    if kind is None:
        raise DataError(f"{at(path)}: {KIND} whose DATA_TYPE is unknown (got {head['DATA_TYPE']!r})")
    order = ">" if "BIG" in head["FORMAT"] else "<"
    begin = BLOCK * _whole(path, head, "NUM_HEADER_BLOCKS", MOST_BLOCKS)
    size = -(-points // group) * group * channels
    samples = np.frombuffer(raw[begin:], dtype=f"{order}{kind}", count=min(size, (len(raw) - begin) // int(kind[1])))
    if samples.size < size:
        raise DataError(f"{at(path)}: ends after {samples.size} of {size} samples that its head says; export it again")
    by_channel = samples.reshape(-1, channels, group).transpose(1, 0, 2).reshape(channels, -1)[:, :points]
    step = _real(path, head, "DELTA_T")
    columns: dict[str, tuple[Cells, str]] = {CLOCK: (np.asarray(step * np.arange(points)), "s")}
    for n in range(channels):
        name = head.get(f"DESC.CHAN_{n + 1}") or f"channel {n + 1}"
        scale = _real(path, head, f"SCALE.CHAN_{n + 1}") if kind == "i2" else 1.0
        called = name if name not in columns else f"{name}.{n + 1}"
        with np.errstate(invalid="ignore"):  # damaged numbers of 32 bits, refused with their rows
            columns[called] = (scale * by_channel[n].astype(np.float64), head.get(f"UNITS.CHAN_{n + 1}", ""))
    units = tuple(unit for _, unit in columns.values())
    return [FileTable("", tuple(columns), tuple(cells for cells, _ in columns.values()), units, clock=CLOCK)]


def _head(path: Path, raw: bytes) -> dict[str, str]:
    """Read the parameters of the head, whose blocks the third of them counts."""
    found: dict[str, str] = {}
    blocks = 1
    for position in range(0, BLOCK * MOST_BLOCKS, RECORD):
        if position >= BLOCK * blocks:
            return found
        record = raw[position : position + RECORD]
        if len(record) < RECORD:
            break
        name, value = (part.split(b"\0")[0].decode("latin-1").strip() for part in (record[:NAME], record[NAME:]))
        if name:
            found[name] = value
        if name == "NUM_HEADER_BLOCKS":
            blocks = _whole(path, found, name, MOST_BLOCKS)
    if BLOCK * blocks == BLOCK * MOST_BLOCKS:
        return found
    raise DataError(f"{at(path)}: {KIND} that ends in its head; export it again")


def _whole(path: Path, head: dict[str, str], key: str, most: int) -> int:
    value = _real(path, head, key)
    if value != int(value) or not 0 < value <= most:
        raise DataError(f"{at(path)}: {KIND} whose {key} is no count up to {most} (got {head[key]!r})")
    return int(value)


def _real(path: Path, head: dict[str, str], key: str) -> float:
    try:
        return number(head[key])
    except (KeyError, ValueError):
        raise DataError(f"{at(path)}: {KIND} without a number for {key} (got {head.get(key, '')!r})") from None
