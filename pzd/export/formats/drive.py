"""A history that drives the stand, as CSV, RPC III and MATLAB 5: the test that diagnose asks for next, or any waveform.

Each file says its units, its loops and its ramps: samples before the first loop, samples of a loop, number of loops.
RPC III is of whole numbers of 16 bits, which every controller takes: a displacement to 1.6e-5 of its largest.
Source: MTS Systems, RPC III file format.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pzd.export.formats import Files, Format

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pzd.export.content import Content
    from pzd.export.drive import Drive
    from pzd.record import Array

NAME = "drive"
_LARGEST = 32000
"""Whole number that stands for the largest value of a channel."""
_FULL_SCALE = 32768
"""INT_FULL_SCALE with which SCALE is the value of one: readers differ in whether they divide by it."""
_RECORD, _KEY, _BLOCK = 128, 32, 512
"""Bytes of a record of an RPC III head, of its name, and of a block."""


def files(content: Content) -> Files:
    """Write the history in each form.

    Raises
    ------
    ConfigError : when there is none
    """
    from pzd.schema.errors import ConfigError

    drive = content.drive
    if drive is None:
        raise ConfigError(f"--to {NAME}: the diagnosis asks for no next test; give a waveform by --waveform")
    name = f"{content.name}-{drive.name}"
    return {
        f"{name}.csv": _csv(content, drive),
        f"{name}.drv": _rpc3(content, drive),
        f"{name}.mat": _mat(content, drive),
    }


def _channels(content: Content, drive: Drive) -> Mapping[str, tuple[Array, str]]:
    """Return the channels but the clock, each with its unit, by the names of rig files."""
    from pzd.quantities import DISPLACEMENT, VOLTAGE

    found = {DISPLACEMENT.column: (drive.displacement, DISPLACEMENT.unit)}
    if drive.signal is not None:
        found[content.control.renamed(VOLTAGE.column)] = (drive.signal, content.control.unit)
    return found


def _said(content: Content, drive: Drive) -> dict[str, str | int | float]:
    """Return what is to be known of the history beside its channels."""
    return {
        "waveform": drive.name,
        "loops": drive.loops,
        "loop_samples": drive.loop_samples,
        "ramp_samples": drive.ramp_samples,
        "step_s": drive.step,
        "middle_m": drive.middle,
        "origin": content.origin,
    }


def _csv(content: Content, drive: Drive) -> bytes:
    import numpy as np

    from pzd.export.content import comment
    from pzd.quantities import TIME

    channels = _channels(content, drive)
    said = [f"{key}: {value}" for key, value in _said(content, drive).items()]
    columns = np.column_stack([drive.time, *(values for values, _ in channels.values())])
    lines = [",".join([TIME.column, *channels]), *(",".join(map(repr, row)) for row in columns.tolist())]
    return (comment(said, "#") + "\n".join(lines) + "\n").encode()


def _mat(content: Content, drive: Drive) -> bytes:
    from pzd.export.formats.mat import matlab
    from pzd.quantities import TIME

    channels = _channels(content, drive)
    units = {TIME.column: TIME.unit} | {name: unit for name, (_, unit) in channels.items()}
    history = {TIME.column: drive.time} | {name: values for name, (values, _) in channels.items()}
    return matlab(history | {"units": units, "drive": _said(content, drive)}, content)


def _rpc3(content: Content, drive: Drive) -> bytes:
    import numpy as np

    channels = _channels(content, drive)
    count, size = len(channels), drive.displacement.size
    head: dict[str, str | int | float] = {
        "FORMAT": "BINARY_IEEE_LITTLE_END",
        "NUM_HEADER_BLOCKS": 0,
        "NUM_PARAMS": 0,
        "FILE_TYPE": "TIME_HISTORY",
        "TIME_TYPE": "DRIVE",
        "DATA_TYPE": "SHORT_INTEGER",
        "CHANNELS": count,
        "DELTA_T": drive.step,
        "PTS_PER_FRAME": drive.loop_samples,
        "PTS_PER_GROUP": drive.loop_samples,
        "FRAMES": -(-size // drive.loop_samples),
        "REPEATS": 1,
        "INT_FULL_SCALE": _FULL_SCALE,
    }
    data = np.empty((count, int(head["FRAMES"]) * drive.loop_samples), dtype="<i2")
    for n, (name, (values, unit)) in enumerate(channels.items(), start=1):
        scale = float(np.max(np.abs(values))) / _LARGEST or 1.0
        head |= {f"DESC.CHAN_{n}": name, f"UNITS.CHAN_{n}": unit, f"SCALE.CHAN_{n}": scale}
        head |= {f"LOWER_LIMIT.CHAN_{n}": float(np.min(values)), f"UPPER_LIMIT.CHAN_{n}": float(np.max(values))}
        whole = np.round(values / scale)
        data[n - 1] = np.concatenate(
            [whole, np.full(data.shape[1] - size, whole[-1])]
        )  # the last frame is filled at rest
    said = _said(content, drive)
    origin = str(said.pop("origin")).encode()
    head |= {f"PZD.{key.upper()}": value for key, value in said.items()}
    entries = [(key.encode(), str(value).encode()) for key, value in head.items()]
    room = _RECORD - _KEY - 1
    entries += [
        (f"PZD.ORIGIN_{i}".encode(), origin[at : at + room]) for i, at in enumerate(range(0, len(origin), room))
    ]
    blocks = -(-len(entries) * _RECORD // _BLOCK)
    counted = {b"NUM_HEADER_BLOCKS": blocks, b"NUM_PARAMS": len(entries)}
    entries = [(key, str(counted[key]).encode() if key in counted else value) for key, value in entries]
    written = b"".join(key.ljust(_KEY, b"\0") + value[:room].ljust(_RECORD - _KEY, b"\0") for key, value in entries)
    groups = data.reshape(count, -1, drive.loop_samples).transpose(1, 0, 2)
    return written.ljust(_BLOCK * blocks, b"\0") + groups.tobytes()


FORMATS = (Format(NAME, "the next test, or any waveform, as CSV, RPC III and .mat to drive the stand", files),)
