"""Structures that Simulink and dSPACE write into MATLAB files, and MATLAB's own classes, which are told as such."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from written_files import FORCE, TIME, X, refused, run

from pzd.rig.files.guess import guessed

UNITS = {"units": {"displacement": "mm", "force": "N", "voltage": "V"}}


def structure_with_time(values: dict[str, Any], time: Any = TIME[:, None]) -> dict[str, Any]:
    signals = [
        {"values": v, "dimensions": 1.0, "label": head, "blockName": f"rig/{n}"}
        for n, (head, v) in enumerate(values.items())
    ]
    return {"time": time, "signals": np.array(signals, dtype=object), "blockName": "rig/Scope"}


def save(path: Path, **variables: Any) -> None:
    from scipy.io import savemat

    savemat(path, variables)


def is_the_test(record: Any) -> None:
    assert record.time == pytest.approx(TIME)
    assert record.displacement == pytest.approx(X, abs=1e-12)
    assert record.force == pytest.approx(FORCE, abs=1e-9)


def test_a_structure_with_time_is_a_table_of_its_labels(tmp_path: Path) -> None:
    volts = np.full((1, 1, TIME.size), 1.5)  # as Simulink logs a signal of one row and one column
    save(
        tmp_path / "a.mat",
        ScopeData=structure_with_time({"Stroke_mm": 1e3 * X[:, None], "Force_N": FORCE, "Valve": volts}),
    )
    entry = {"columns": {"time": "time", "displacement": "Stroke_mm", "force": "Force_N", "voltage": "Valve"}} | UNITS
    rig = run(tmp_path, {"path": "a.mat"} | entry)
    is_the_test(rig.records[0])
    assert rig.entries[0].voltage_V == pytest.approx(1.5)
    text = "\n".join(guessed([tmp_path / "a.mat"]))
    for line in ("time: time", "displacement: Stroke_mm", "force: Force_N", "displacement: mm"):
        assert line in text


def test_structures_of_several_blocks_share_the_clock_of_the_simulation(tmp_path: Path) -> None:
    save(
        tmp_path / "a.mat",
        stroke=structure_with_time({"": 1e3 * X[::2, None]}, TIME[::2, None]) | {"blockName": "rig/x"},
        load=structure_with_time({"Load": FORCE}),
    )
    entry = {"columns": {"time": "time", "displacement": "rig/0", "force": "Load"}} | UNITS
    (record,) = run(tmp_path, {"path": "a.mat"} | entry).records
    assert record.rate == pytest.approx(500.0)
    assert record.displacement == pytest.approx(X[: record.time.size], abs=1e-6)


def test_arrays_beside_a_vector_of_time_are_read_as_they_stand(tmp_path: Path) -> None:
    save(tmp_path / "a.mat", tout=TIME[:, None], yout=np.stack([1e3 * X, FORCE], axis=1))
    entry = {
        "columns": {"time": "tout", "displacement": "yout.1", "force": "yout.2"},
        "units": {"time": "s", "displacement": "mm", "force": "N"},
    }
    is_the_test(run(tmp_path, {"path": "a.mat"} | entry).records[0])


def test_a_capture_of_dspace_is_read_by_names_units_and_rasters(tmp_path: Path) -> None:
    signals = [
        {"Name": "Model Root/Stroke", "Type": 8.0, "Data": 1e3 * X[None, :], "Unit": "mm", "XIndex": 1.0},
        {"Name": "Model Root/Load", "Type": 8.0, "Data": FORCE[None, :], "Unit": "N", "XIndex": 1.0},
        {"Name": "Model Root/Oil", "Type": 8.0, "Data": np.full((1, 11), 40.0), "Unit": "degC", "XIndex": 2.0},
    ]
    clocks = [
        {"Name": "HostService", "Type": 4.0, "Data": t[None, :], "Unit": "s"} for t in (TIME, np.arange(11) * 0.1)
    ]
    save(
        tmp_path / "a.mat",
        capture={
            "X": np.array(clocks, dtype=object),
            "Y": np.array(signals, dtype=object),
            "Description": {"General": "x"},
        },
    )
    heads = {"displacement": "Model Root/Stroke", "force": "Model Root/Load", "temperature": "Model Root/Oil"}
    rig = run(tmp_path, {"path": "a.mat", "columns": {"time": "time", **heads}})
    is_the_test(rig.records[0])
    assert rig.entries[0].temperature_degC == pytest.approx(40.0)


def version_7_3(path: Path) -> Any:
    import h5py

    return h5py.File(path, "w", userblock_size=512)


def finished(path: Path, file: Any) -> None:
    file.close()
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512))


def test_a_structure_with_time_of_version_7_3_is_followed_through_its_references(tmp_path: Path) -> None:
    import h5py

    path = tmp_path / "a.mat"
    file = version_7_3(path)
    file.create_dataset("ScopeData/time", data=TIME[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
    fields: dict[str, list[Any]] = {"values": [], "label": []}
    for n, (label, values) in enumerate((("Stroke", 1e3 * X), ("Load", FORCE))):
        stored = file.create_dataset(f"#refs#/v{n}", data=values[None, :])
        stored.attrs["MATLAB_class"] = np.bytes_("double")
        text = file.create_dataset(f"#refs#/l{n}", data=np.array([[ord(c)] for c in label], dtype=np.uint16))
        text.attrs["MATLAB_class"] = np.bytes_("char")
        fields["values"].append(stored.ref)
        fields["label"].append(text.ref)
    for name, references in fields.items():
        file.create_dataset(f"ScopeData/signals/{name}", data=np.array([references], dtype=h5py.ref_dtype))
    finished(path, file)
    entry = {"columns": {"time": "time", "displacement": "Stroke", "force": "Load"}} | UNITS
    is_the_test(run(tmp_path, {"path": "a.mat"} | entry).records[0])


def test_a_table_of_version_7_3_is_told_as_such_with_how_to_export_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    file = version_7_3(path)
    opaque = file.create_dataset("T", data=np.array([[3707764736, 2, 1, 1, 1, 1]], dtype=np.uint32))
    opaque.attrs["MATLAB_class"] = np.bytes_("table")
    opaque.attrs["MATLAB_object_decode"] = np.int32(3)
    file.create_dataset("#subsystem#/MCOS", data=np.zeros((1, 3), dtype=np.uint8))
    finished(path, file)
    (message,) = refused(tmp_path, {"path": "a.mat"})
    assert "objects of MATLAB's own classes (table, timetable, timeseries)" in message
    assert "writetable(T, 'test.csv')" in message
