"""Units of headers and configs: read by a grammar, nothing evaluated; right, or refused naming the signal."""

from __future__ import annotations

import re
from pathlib import Path
from time import monotonic

import numpy as np
import pytest
from written_files import FORCE, TIME, X, lines, run, write, wrong

from pzd.config import load
from pzd.quantities import ACCELERATION, DISPLACEMENT, PRESSURE, TEMPERATURE, VELOCITY, Quantity
from pzd.quantities import FORCE as LOAD
from pzd.rig.files.guess import guessed
from pzd.rig.files.units import UnitError, constant, to_canonical
from pzd.rig.stage import ingest

READ = [
    ("mm", DISPLACEMENT, 1e-3),
    ('"', DISPLACEMENT, 0.0254),
    ("'", DISPLACEMENT, 0.3048),
    ("\u00b5m", DISPLACEMENT, 1e-6),
    ("m/s2", ACCELERATION, 1.0),
    ("mm/s^2", ACCELERATION, 1e-3),
    ("m/s\u00b2", ACCELERATION, 1.0),
    ("ft/s/s", ACCELERATION, 0.3048),
    ("m s^-1", VELOCITY, 1.0),
    ("kg m/s2", LOAD, 1.0),
    ("lbs", LOAD, 4.4482216),
    ("Lbs", LOAD, 4.4482216),
    ("in.", DISPLACEMENT, 0.0254),
    ("980.665 N", LOAD, 980.665),
    ("kgf/cm2", PRESSURE, 98066.5),
    ("lbf/in**2", PRESSURE, 6894.757),
    ("1/s m", VELOCITY, None),
    ("cm/s^1.75", Quantity("VDV", "VDV", "m/s^1.75", "vibration dose value"), 0.01),
]


@pytest.mark.parametrize(("unit", "quantity", "one"), READ)
def test_products_quotients_and_powers_are_read(unit: str, quantity: Quantity, one: float | None) -> None:
    if one is None:
        with pytest.raises(UnitError, match="unclear"):
            to_canonical(np.ones(1), unit, quantity)
    else:
        assert to_canonical(np.ones(1), unit, quantity)[0] == pytest.approx(one, rel=1e-6)


@pytest.mark.parametrize(
    ("unit", "quantity", "one"), [("kg", LOAD, 9.80665), ("lb", LOAD, 4.4482216), ("ips", VELOCITY, 0.0254)]
)
def test_what_is_meant_by_a_unit_of_another_quantity_is_offered_and_read(
    unit: str, quantity: Quantity, one: float
) -> None:
    with pytest.raises(UnitError) as caught:
        to_canonical(np.ones(1), unit, quantity)
    (meant,) = re.findall(r"; write '(\S+)' ", str(caught.value))
    assert to_canonical(np.ones(1), meant, quantity)[0] == pytest.approx(one, rel=1e-6)
    with pytest.raises(UnitError, match="write one like 'degC'"):
        to_canonical(np.ones(1), unit, TEMPERATURE)


def test_init_asks_with_the_unit_that_is_meant(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", lines({"t(ms)": 1e3 * TIME, "s(in.)": X / 0.0254, "F(kg)": FORCE / 9.80665}))
    text = guessed([path])
    assert "        force:   # fill in: F(kg) is in kg: write 'kgf' where kilogram-force are meant" in text
    assert sum("fill in" in line for line in text) == 1


NO_UNITS = [
    "F0",
    "N/0",
    "N*9**9**9",
    "N**99999",
    "(N",
    "N)",
    "N.__class__",
    "N" * 60,
    "0 N",
    "1e999 N",
    "nan",
    "N/",
    "*N",
]


@pytest.mark.parametrize("unit", NO_UNITS)
def test_what_is_no_unit_is_refused_at_once_whatever_it_is(unit: str) -> None:
    begun = monotonic()
    with pytest.raises(UnitError, match="force: "):
        to_canonical(np.ones(1), unit, LOAD)
    assert monotonic() - begun < 2.0


def test_a_constant_is_finite() -> None:
    with pytest.raises(UnitError, match="finite"):
        constant("1e999 degC", TEMPERATURE)


HEADERS = {
    'Pos (")': ("displacement", 'Pos (")', None),
    "Load [']": ("force", "Load [']", "no unit of it"),
    "Load (F0)": ("force", "Load (F0)", "no unit of it"),
    "Load [N/0]": ("force", "Load [N/0]", "no unit of it"),
    "F [N*9**9**9]": ("force", "F [N*9**9**9]", "no unit of it"),
    "Load x10 [N]": ("force", "Load x10 [N]", "names a factor, x10"),
}


@pytest.mark.parametrize("header", HEADERS)
def test_an_odd_header_is_read_right_or_refused_naming_the_signal(tmp_path: Path, header: str) -> None:
    """What the refusal asks for is then accepted, and `pzd init` asks for the same."""
    quantity, head, refusal = HEADERS[header]
    columns = {"time": "Time [s]", "displacement": "Pos [mm]", "force": "Load [N]"} | {quantity: head}
    values = {"time": TIME, "displacement": X / (0.0254 if refusal is None else 1e-3), "force": FORCE}
    write(tmp_path / "a.csv", lines({columns[name]: cells for name, cells in values.items()}))
    entry = {"path": "a.csv", "columns": columns}
    if refusal is not None:
        (said,) = wrong(tmp_path, entry)
        assert f"rig.files.0.units: {quantity}" in said
        assert refusal in said
        entry |= {"units": {quantity: "N"}}
    (record,) = run(tmp_path, entry).records
    assert np.abs(record.displacement - X).max() < 1e-9
    assert np.abs(record.force - FORCE).max() < 1e-5
    asked = any(line.startswith(f"        {quantity}:   # fill in: ") for line in guessed([tmp_path / "a.csv"]))
    assert asked == (refusal is not None)


@pytest.mark.parametrize(("unit", "one"), [("10 N", 10.0), ("0.1 N", 0.1)])
def test_a_factor_in_a_header_counts_as_the_config_says(tmp_path: Path, unit: str, one: float) -> None:
    write(tmp_path / "a.csv", lines({"time_s": TIME, "displacement_m": X, "Load x10 [N]": FORCE / one}))
    entry = {"path": "a.csv", "columns": {"force": "Load x10 [N]"}, "units": {"force": unit}}
    assert np.abs(run(tmp_path, entry).records[0].force - FORCE).max() < 1e-5


@pytest.mark.parametrize("head", ['Pos "', 'Pos (")', '"Pos ("")"', '"Pos [in]"'])
def test_inches_in_quotes_or_as_a_quote_are_guessed_and_read_back(tmp_path: Path, head: str) -> None:
    write(tmp_path / "a.csv", lines({"Time [s]": TIME, head: X / 0.0254, "Load [N]": FORCE}))
    text = "\n".join(guessed([tmp_path / "a.csv"]))
    text = re.sub(r"(displacement:)   # fill in: .*", r"\1 in", text)
    (tmp_path / "guess.yaml").write_text(text, encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    (record,) = ingest(config.rig, config.control.signal(), tmp_path).records
    assert np.abs(record.displacement - X).max() < 1e-9


@pytest.mark.parametrize(
    ("unit", "zero", "volts_of"),
    [
        ("-200 N/V about the mean of the first 10", 2.5, 1.0),
        ("-200 N/V about 2.5 V", 2.5, 1.0),
        ("-0.2 kN/V about 2.5", 2.5, 1.0),
        ("-0.2 N/mV about 2500 mV", 2500.0, 1e3),
        ("-20.394324 kgf/V about the mean of the first 50", 0.31, 1.0),
    ],
)
def test_volts_with_a_calibration_and_a_zero_are_read_as_newtons(
    tmp_path: Path, unit: str, zero: float, volts_of: float
) -> None:
    """The rod stands still at first, so that the cell shows its zero."""
    time = np.arange(TIME.size + 60) * 2e-3
    x, force = (np.concatenate((np.zeros(60), values)) for values in (X, FORCE))
    write(tmp_path / "a.csv", lines({"time_s": time, "displacement_m": x, "Load": zero - volts_of * force / 200.0}))
    entry = {"path": "a.csv", "columns": {"force": "Load"}, "units": {"force": unit}}
    rig = run(tmp_path, entry)
    assert rig.records[0].force == pytest.approx(force, abs=2e-3)
    assert any(row.step == "unit" and row.was == unit for row in rig.ingested)


@pytest.mark.parametrize("unit", ["200 N/V about the mean of the first 0", "200 N/V about", "about 2 V", "200 N/A"])
def test_a_calibration_that_means_nothing_is_refused(tmp_path: Path, unit: str) -> None:
    write(tmp_path / "a.csv", lines({"time_s": TIME, "displacement_m": X, "Load": FORCE}))
    (said,) = wrong(tmp_path, {"path": "a.csv", "columns": {"force": "Load"}, "units": {"force": unit}})
    assert "rig.files.0.units: force:" in said


@pytest.mark.parametrize(
    ("unit", "newtons"),
    [("gf", 9.80665e-3), ("kgf", 9.80665), ("lbf", 4.4482216152605), ("daN", 10.0), ("kip", 4448.2216)],
)
def test_forces_of_the_trade(unit: str, newtons: float) -> None:
    assert to_canonical(np.array([2.0]), unit, LOAD) == pytest.approx([2.0 * newtons], rel=1e-7)
