"""RPC III files, written here by struct after the format: of either byte order, whole numbers or of 32 bits."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from written_files import FORCE, TIME, X, refused, run

from pzd.rig.files.guess import guessed

NAMED = {"columns": {"time": "time", "displacement": "Stroke", "force": "Load Cell"}}
FULL = 32752


def write(path: Path, kind: str = "SHORT_INTEGER", big: bool = False, group: int = 64, **changed: str) -> None:
    """Two channels, each of its own full scale, group by group; the last frame is filled up with zeros."""
    channels = [("Stroke", "mm", 1e3 * X), ("Load Cell", "N", FORCE)]
    frames = -(-TIME.size // 100)
    said: dict[str, Any] = {
        "FORMAT": "BINARY_IEEE_BIG_END" if big else "BINARY_IEEE_LITTLE_END",
        "NUM_HEADER_BLOCKS": 6,
        "NUM_PARAMS": 22,
        "FILE_TYPE": "TIME_HISTORY",
        "TIME_TYPE": "RESPONSE",
        "DELTA_T": "2.000000e-03",
        "CHANNELS": 2,
        "PTS_PER_FRAME": 100,
        "PTS_PER_GROUP": group,
        "FRAMES": frames,
        "INT_FULL_SCALE": FULL,
        "DATA_TYPE": kind,
    }
    for n, (name, unit, values) in enumerate(channels, start=1):
        said |= {
            f"DESC.CHAN_{n}": name,
            f"UNITS.CHAN_{n}": unit,
            f"SCALE.CHAN_{n}": f"{np.abs(values).max() / FULL:.9e}",
        }
    head = b"".join(struct.pack("32s96s", k.encode(), str(v).encode()) for k, v in (said | changed).items())
    data = b""
    total = -(-frames * 100 // group) * group
    for start in range(0, total, group):
        for n, (_, _, values) in enumerate(channels, start=1):
            for value in np.pad(values, (0, total - values.size))[start : start + group]:
                if kind == "SHORT_INTEGER":
                    scale = float(said[f"SCALE.CHAN_{n}"])
                    data += struct.pack(">h" if big else "<h", round(value / scale))
                else:
                    data += struct.pack(">f" if big else "<f", value)
    path.write_bytes(head.ljust(6 * 512, b"\0") + data)


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("kind", ["SHORT_INTEGER", "FLOATING_POINT"])
@pytest.mark.parametrize("group", [1, 64, 100, 500])
def test_every_sample_is_read(tmp_path: Path, kind: str, big: bool, group: int) -> None:
    write(tmp_path / "a.rsp", kind, big, group)
    (record,) = run(tmp_path, {"path": "a.rsp"} | NAMED).records
    digit = 1.0 / FULL if kind == "SHORT_INTEGER" else 1e-7
    assert record.time == pytest.approx(TIME)
    assert record.displacement == pytest.approx(X, abs=digit * np.abs(X).max())
    assert record.force == pytest.approx(FORCE, abs=digit * np.abs(FORCE).max())


def test_it_is_known_by_its_content_and_init_reads_names_and_units(tmp_path: Path) -> None:
    write(tmp_path / "a.csv")
    text = "\n".join(guessed([tmp_path / "a.csv"]))
    assert "fill in" not in text
    assert "displacement: Stroke" in text
    assert "force: Load Cell" in text


def test_what_is_cut_off_or_no_recording_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "a.rsp")
    content = (tmp_path / "a.rsp").read_bytes()
    for cut, says in ((1000, "ends in its head"), (len(content) - 2, "samples that its head says")):
        (tmp_path / "a.rsp").write_bytes(content[:cut])
        assert says in refused(tmp_path, {"path": "a.rsp"} | NAMED)[0]
    for changed, says in (
        ({"FILE_TYPE": "MATRIX"}, "of MATRIX, which is no recording over time"),
        ({"CHANNELS": "9" * 30}, "whose CHANNELS is no count up to 256"),
        ({"FRAMES": "1e300"}, "whose FRAMES is no count"),
        ({"DELTA_T": "often"}, "without a number for DELTA_T"),
    ):
        write(tmp_path / "a.rsp", **changed)
        assert says in refused(tmp_path, {"path": "a.rsp"} | NAMED)[0]
