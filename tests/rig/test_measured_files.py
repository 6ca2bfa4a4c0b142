"""The measured dampers beside the project are read in place, raw and converted alike, and the preflight knows them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pzd.artefacts import Rig
from pzd.quantities import Control
from pzd.rig.config import RigConfig
from pzd.rig.stage import ingest
from pzd.signals.cycles import cycles

CURRENT = Control("current", "A")
MILLIMETRES = {"columns": {"displacement": "displacement_mm"}, "units": {"displacement": "mm"}}


def read(folder: Path, entry: dict[str, Any], control: Control, *, preflight: bool = True) -> Rig:
    config = RigConfig.model_validate_json(json.dumps({"files": [entry]}))
    return ingest(config, control, folder, preflight=preflight)


def checks(rig: Rig) -> set[str]:
    return {finding.check for entry in rig.entries for finding in entry.findings}


def test_the_press_rests_ramps_in_and_shows_an_offset(shared: Path) -> None:
    rig = read(shared / "data", {"path": "utfsm-mr/converted/*.csv", **MILLIMETRES}, CURRENT)
    assert len(rig.records) == 17
    assert checks(rig) <= {"offset", "rest", "sampling", "delay", "resolution"}
    for record, entry in zip(rig.records, rig.entries, strict=True):
        assert "rest" in {finding.check for finding in entry.findings}
        run = cycles(record.time, record.displacement)
        assert run is not None
        assert 4 <= run.count <= 10
        amplitude, frequency = record.name.split("_")[0].removesuffix("Hz").split("mm")
        # The controller runs 2 % fast, and does not reach the stroke of the quick tests.
        assert run.frequency == pytest.approx(1.02 * float(frequency.replace("x", ".")), rel=0.01)
        assert np.ptp(record.displacement) <= 2e-3 * float(amplitude)
    offsets = [finding.size for entry in rig.entries for finding in entry.findings if finding.check == "offset"]
    assert 30.0 < np.median(offsets) < 60.0


def test_the_export_of_the_logger_and_the_converted_files_are_the_same_tests(shared: Path) -> None:
    raw = {
        "path": "utfsm-mr/raw/*.txt",
        "skip": 6,
        "columns": {"time": "Date/Time", "force": "CHANNEL0", "displacement": "CHANNEL1"},
        "units": {"time": "%m/%d/%Y %I:%M:%S.%f %p", "force": "980.665 N", "displacement": "10 mm"},
        "split": {
            "event": "Events",
            "begins": "DAQ Resume",
            "constants": {"current": ["0 A", "0.25 A", "0.5 A", "0.75 A", "1 A"]},
        },
    }
    exported = {record.name: record for record in read(shared / "data", raw, CURRENT, preflight=False).records}
    assert len(exported) == 10
    rig = read(shared / "data", {"path": "utfsm-mr/converted/2*mm*5Hz_*.csv", **MILLIMETRES}, CURRENT, preflight=False)
    converted = {record.name: record for record in rig.records}
    for number, current in ((1, "0"), (3, "0.5"), (5, "1")):
        for test in ("25mm0x5Hz", "2mm5Hz"):
            ours, theirs = exported[f"ME{test}-{number}"], converted[f"{test}_{current}A"]
            assert ours.median_voltage() == float(current)
            assert ours.force == pytest.approx(theirs.force, abs=0.06)
            assert np.ptp(ours.displacement) == pytest.approx(np.ptp(theirs.displacement), abs=1e-4)
            assert np.diff(ours.time) == pytest.approx(np.diff(theirs.time), abs=1e-6)


def test_the_shaking_table_drifts_and_its_tare_differs_from_file_to_file(shared: Path) -> None:
    rig = read(shared / "data", {"path": "utfpr-mr/converted/*.csv", **MILLIMETRES}, Control())
    assert len(rig.records) == 38
    offsets = {e.name: f.size for e in rig.entries for f in e.findings if f.check == "offset"}
    tared = [name for name, size in offsets.items() if 95.0 < size < 160.0]
    assert len(tared) >= 20
    assert all(abs(size) < 20.0 for name, size in offsets.items() if name not in tared)
    assert all(cycles(record.time, record.displacement) is not None for record in rig.records)
