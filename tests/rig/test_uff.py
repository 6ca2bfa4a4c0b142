"""Universal files, dataset 58: functions of time are columns with units, of one clock or several."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.rig.config import FilesEntry, Limits
from pzd.rig.files.guess import guessed
from pzd.rig.files.reading import read
from pzd.schema.errors import DataError

RATE, FREQUENCY, AMPLITUDE, DAMPING = 1000.0, 2.0, 0.02, 2500.0


def motion(rate: float = RATE, begin: float = 0.0, cycles: float = 6.0, damping: float = DAMPING) -> tuple[Array, ...]:
    """Time [s], displacement [m] and force [N] of a viscous damper under a sine."""
    t = begin + np.arange(int((cycles / FREQUENCY - begin) * rate)) / rate
    omega = 2.0 * np.pi * FREQUENCY
    return t, AMPLITUDE * np.sin(omega * t), damping * AMPLITUDE * omega * np.cos(omega * t)


Channel = tuple[str, int, str, Array, Array]
"""Label, specific data type, unit, time [s], values."""


def dataset(channel: Channel, node: int, *, binary: bool, kind: int = 1) -> bytes:
    """Write a function by the published records of dataset 58, in double precision with even spacing."""
    label, quantity, unit, time, values = channel
    head = [f"{label:<80}", *[f"{'NONE':<80}"] * 4]
    head.append(f"{kind:5d}{0:10d}{0:5d}{0:10d} {'NONE':<10}{node:10d}{3:4d} {'NONE':<10}{1:10d}{3:4d}")
    head.append(f"{4:10d}{time.size:10d}{1:10d}{time[0]:13.5e}{time[1] - time[0]:13.5e}{0.0:13.5e}")
    for of, name, its_unit in ((17, "Time", "s"), (quantity, "NONE", unit), (0, "NONE", "NONE"), (0, "NONE", "NONE")):
        head.append(f"{of:10d}{0:5d}{0:5d}{0:5d} {name:<20} {its_unit:<20}")
    rows = "".join("".join(f"{v:20.11e}" for v in values[n : n + 4]) + "\n" for n in range(0, values.size, 4))
    data = values.astype("<f8").tobytes() if binary else rows.encode()
    first = f"{58:6d}b{1:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}" if binary else f"{58:6d}"
    return "\n".join(["    -1", f"{first:<80}", *head, ""]).encode() + data + b"\n" * binary + b"    -1\n"


def written(path: Path, *channels: Channel, binary: bool = False, kind: int = 1) -> Path:
    """Write channels behind what a file holds."""
    with path.open("ab") as file:
        for node, channel in enumerate(channels, 1):
            file.write(dataset(channel, node, binary=binary, kind=kind))
    return path


def test_lines_that_name_the_whole_test_name_no_channel(tmp_path: Path) -> None:
    """Data loaders write the model into the first line of each function: then its type names the channel."""
    t, x, force = motion()
    path = written(tmp_path / "rig.uff", ("strut 4711", 8, "m", t, x), ("strut 4711", 13, "N", t, force))
    (found,) = records(path, {"displacement": "displacement", "force": "force"})
    np.testing.assert_allclose(found.force, force, atol=1e-3)


def records(path: Path, columns: dict[str, str]) -> list[Record]:
    entry = FilesEntry(path=path.name, columns={"time": "time", **columns})
    return [make().record for make in read((entry,), Limits(), Control(), path.parent)]


COLUMNS = {"displacement": "Stroke", "force": "Load"}


@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
def test_channels_of_one_clock_are_a_test_in_their_own_units(tmp_path: Path, *, binary: bool) -> None:
    t, x, force = motion()
    channels = ("Stroke", 8, "mm", t, 1e3 * x), ("Load", 13, "kN", t, 1e-3 * force)
    (found,) = records(written(tmp_path / "rig.uff", *channels, binary=binary), COLUMNS)
    np.testing.assert_allclose(found.time, t, atol=1e-6)
    np.testing.assert_allclose(found.displacement, x, atol=1e-8)
    np.testing.assert_allclose(found.force, force, atol=1e-3)


def test_a_channel_that_begins_late_and_samples_slower_is_put_on_the_clock_of_the_other(tmp_path: Path) -> None:
    t, _, force = motion()
    late, x, _ = motion(500.0, begin=0.137)
    path = written(tmp_path / "rig.uff", ("Stroke", 8, "m", late, x), ("Load", 13, "N", t, force))
    (found,) = records(path, COLUMNS)
    speed = np.gradient(found.displacement, found.time)[50:-50]
    slope = float(speed @ found.force[50:-50] / (speed @ speed))
    assert slope == pytest.approx(DAMPING, rel=2e-3)


def test_where_a_channel_stands_again_the_next_test_begins(tmp_path: Path) -> None:
    path = tmp_path / "rig.uff"
    for damping in (DAMPING, 2.0 * DAMPING):
        t, x, force = motion(damping=damping)
        written(path, ("Stroke", 8, "m", t, x), ("Load", 13, "N", t, force))
    found = records(path, COLUMNS)
    assert len(found) == 2
    assert float(found[1].force.max() / found[0].force.max()) == pytest.approx(2.0, rel=1e-3)


def test_init_reads_its_headers_and_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    t, x, force = motion()
    written(Path("rig.uff"), ("Stroke", 8, "mm", t, 1e3 * x), ("Load", 13, "kN", t, 1e-3 * force))
    lines = "\n".join(guessed([Path("rig.uff")]))
    assert "displacement: Stroke" in lines
    assert "force: Load" in lines
    assert "fill in" not in lines


def test_spectra_alone_are_told(tmp_path: Path) -> None:
    t, x, _ = motion()
    path = written(tmp_path / "rig.uff", ("Stroke", 8, "m", t, x), kind=4)  # a frequency response function
    with pytest.raises(DataError, match="without a function of time"):
        records(path, COLUMNS)
