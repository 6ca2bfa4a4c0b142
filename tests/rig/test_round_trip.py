"""Property: however a rig writes a test down, and wherever its zero lies, the record is the same."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from written_files import FORCE, TIME, X, run, write

from pzd.record import Array, Record

LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "inch": 0.0254}
FORCES = {"N": 1.0, "kN": 1e3, "daN": 10.0, "lbf": 4.4482216152605}
CLOCKS = {"s": 1.0, "ms": 1e-3, "min": 60.0}
DIALECTS = [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", "."), (" ", ",")]


def written(time: Array, x: Array, force: Array, **how: Any) -> Record:
    """The record that is read of a file written in the way given."""
    columns = {
        "time": time / CLOCKS[how["clock"]],
        "displacement": how["x_sign"] * x / LENGTHS[how["length"]],
        "force": how["force_sign"] * force / FORCES[how["unit"]],
    }
    names = [list(columns)[index] for index in how["order"]]
    separator, decimal = how["dialect"]
    units = {"time": how["clock"], "displacement": how["length"], "force": how["unit"]}
    head = [separator.join(names)]
    if how["units_row"]:
        head.append(separator.join(f"[{units[name]}]" for name in names))
    rows = zip(*(columns[name].tolist() for name in names), strict=True)
    body = [separator.join(repr(cell).replace(".", decimal) for cell in row) for row in rows]
    entry = {
        "path": "a.txt",
        "columns": {name: name for name in names},
        "units": {} if how["units_row"] else units,
        "sign": {"displacement": how["x_sign"], "force": how["force_sign"]},
        "separator": separator,
        "decimal": decimal,
        "units_row": how["units_row"],
        "skip": how["skip"],
    }
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / "a.txt", ["a logger wrote this"] * how["skip"] + head + body)
        (record,) = run(Path(folder), entry).records
    return record


PLAIN = {
    "clock": "s",
    "length": "m",
    "unit": "N",
    "x_sign": 1,
    "force_sign": 1,
    "order": (0, 1, 2),
    "dialect": (",", "."),
    "units_row": False,
    "skip": 0,
}
WAYS = st.fixed_dictionaries(
    {
        "clock": st.sampled_from(sorted(CLOCKS)),
        "length": st.sampled_from(sorted(LENGTHS)),
        "unit": st.sampled_from(sorted(FORCES)),
        "x_sign": st.sampled_from([1, -1]),
        "force_sign": st.sampled_from([1, -1]),
        "order": st.permutations([0, 1, 2]),
        "dialect": st.sampled_from(DIALECTS),
        "units_row": st.booleans(),
        "skip": st.integers(0, 3),
    }
)


def same(one: Array, other: Array) -> bool:
    return bool(np.abs(one - other).max() <= 1e-9 * np.abs(other).max())


@pytest.fixture(scope="module")
def plain() -> Record:
    return written(TIME, X, FORCE, **PLAIN)


@settings(derandomize=True, max_examples=30)
@given(how=WAYS)
def test_dialect_unit_sign_and_order_of_columns_change_nothing(plain: Record, how: dict[str, Any]) -> None:
    record = written(TIME, X, FORCE, **how)
    for channel in ("time", "displacement", "velocity", "acceleration", "force"):
        assert same(getattr(record, channel), getattr(plain, channel)), channel


@settings(derandomize=True, max_examples=12)
@given(scale=st.floats(0.1, 3.0), shift=st.floats(-1e5, 1e5), mirror=st.booleans(), gain=st.floats(0.01, 100.0))
def test_a_test_scaled_shifted_in_time_and_mirrored_gives_the_record_so_changed(
    plain: Record, scale: float, shift: float, mirror: bool, gain: float
) -> None:
    side = -1.0 if mirror else 1.0
    record = written(TIME + shift, side * scale * X, side * gain * FORCE, **PLAIN)
    assert np.abs(record.time - plain.time - shift).max() < 1e-9 * max(1.0, abs(shift))
    assert same(record.force, side * gain * plain.force)
    assert same(record.displacement, side * scale * plain.displacement)
    for channel in ("velocity", "acceleration"):
        expected = side * scale * getattr(plain, channel)
        assert np.abs(getattr(record, channel) - expected).max() < 1e-6 * np.abs(expected).max(), channel
