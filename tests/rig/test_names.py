"""Names: numbers in the names of files, and control signals that are called as something else is."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from written_files import CANONICAL, FORCE, TIME, X, lines, run, write, wrong

import pzd.artefacts  # noqa: F401  # declares the blocks whose keys are looked at
from pzd.config import load
from pzd.quantities import Control
from pzd.rig.files.guess import guessed
from pzd.rig.stage import ingest
from pzd.schema.errors import ConfigError
from pzd.schema.model import all_keys
from pzd.schema.validate import canonical

PLAIN = {"time_s": TIME, "displacement_m": X, "force_N": FORCE}

# ---------------------------------------------------------------- numbers in the names of files

NUMBERS: dict[str, tuple[str, float, dict[str, Any]]] = {
    "b_1,5V": ("voltage", 1.5, {"units": {"voltage": "V"}}),
    "b_1.5V": ("voltage", 1.5, {"units": {"voltage": "V"}}),
    "b_0x5V": ("voltage", 0.5, {"units": {"voltage": "V"}}),
    "b_0p5V": ("voltage", 0.5, {"units": {"voltage": "V"}}),
    "b 0.5 Volts": ("voltage", 0.5, {"units": {"voltage": "V"}}),
    "b_2_150V": ("voltage", 150.0, {"units": {"voltage": "V"}}),
    "sine_T-20C": ("temperature", -20.0, {"units": {"temperature": "degC"}}),
    "sine_-20C": ("temperature", -20.0, {"units": {"temperature": "degC"}}),
    "temp-7C_b": ("temperature", -7.0, {"units": {"temperature": "degC"}}),
    "run-20C": ("temperature", 20.0, {"units": {"temperature": "degC"}}),
    "run_104F": ("temperature", 40.0, {"units": {"temperature": "degF"}}),
    "run_50degF": ("temperature", 10.0, {"units": {"temperature": "degF"}}),
}


def read_by(folder: Path, pattern: str, more: dict[str, Any]) -> float | None:
    (entry,) = run(folder, {"path": "*.csv", "pattern": pattern, **more}).entries
    return entry.voltage_V if "voltage" in pattern else entry.temperature_degC


@pytest.mark.parametrize("name", NUMBERS)
def test_a_number_in_a_name_is_guessed_whole_and_with_its_sign(tmp_path: Path, name: str) -> None:
    quantity, value, _ = NUMBERS[name]
    write(tmp_path / f"{name}.csv", lines(PLAIN))
    (tmp_path / "guess.yaml").write_text("\n".join(guessed([tmp_path / f"{name}.csv"])), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    (entry,) = ingest(config.rig, config.control.signal(), tmp_path).entries
    assert (entry.voltage_V if quantity == "voltage" else entry.temperature_degC) == pytest.approx(value)


@pytest.mark.parametrize(
    ("names", "levels"),
    [
        (("r_500mA", "r_1A"), (0.5, 1.0)),
        (("r_0.5Amp", "r_2 Amps"), (0.5, 2.0)),
        (("r_0x1kV", "r_150V"), (100.0, 150.0)),
        (("r_40%", "r_80pct"), (40.0, 80.0)),
        (("pwm_40%_a", "pwm80%_a"), (40.0, 80.0)),
        (("strom0.5A", "Strom1A"), (0.5, 1.0)),
        (("I0p0A_f1Hz_20", "I1p25A_f1Hz_20"), (0.0, 1.25)),
        (("U=0,0V T=25C f=1 A=20", "U=100,0V T=25C f=2 A=20"), (0.0, 100.0)),  # an amplitude, no amperes
        (("Test 1 I=0.5A", "Test 2 I=1A"), (0.5, 1.0)),
    ],
)
def test_levels_whose_units_differ_from_name_to_name_are_read_each_by_its_own(
    tmp_path: Path, names: tuple[str, str], levels: tuple[float, float]
) -> None:
    for name in names:
        write(tmp_path / f"{name}.csv", lines(PLAIN))
    (tmp_path / "guess.yaml").write_text("\n".join(guessed(sorted(tmp_path.glob("*.csv")))), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    found = ingest(config.rig, config.control.signal(), tmp_path).entries
    assert {entry.voltage_V for entry in found} == {*levels}


@pytest.mark.parametrize("names", [("a_current=0.5", "a_current=1.0"), ("Current 0x5", "Current 1")])
def test_a_number_behind_the_word_for_a_level_is_asked_for_its_unit(tmp_path: Path, names: tuple[str, str]) -> None:
    for name in names:
        write(tmp_path / f"{name}.csv", lines(PLAIN))
    said = "\n".join(guessed(sorted(tmp_path.glob("*.csv"))))
    assert "control: {name: current, unit: A}" in said
    asked = "current:   # fill in: the unit of current in the files' names"
    assert asked in said
    (tmp_path / "guess.yaml").write_text(said.replace(asked, "current: A"), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    found = ingest(config.rig, config.control.signal(), tmp_path).entries
    assert {entry.voltage_V for entry in found} == {0.5, 1.0}


@pytest.mark.parametrize("mark", "_-")
def test_a_number_in_a_name_that_may_be_two_is_asked_for_and_either_answer_is_read(tmp_path: Path, mark: str) -> None:
    """Is r_0_5A half an ampere, or the first run at five? By either reading levels may be merged or exchanged."""
    for level in ("0", "5"):
        write(tmp_path / f"r_0{mark}{level}A.csv", lines(PLAIN))
    text = guessed(sorted(tmp_path.glob("*.csv")))
    (asked,) = (line for line in text if "pattern:" in line)
    assert f"is 0{mark}5A in the names 0.5 A" in asked
    assert "control: {name: current, unit: A}" in text
    (tmp_path / "guess.yaml").write_text("\n".join(text), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"pattern: is empty; fill in one of the answers beside it"):
        load(tmp_path / "guess.yaml")
    for answer, levels in zip(re.findall(r"'(\(\?P[^']+)'", asked), ({0.0, 0.5}, {0.0, 5.0}), strict=True):
        said = "\n".join(text).replace("pattern: ''", f"pattern: '{answer}'")
        (tmp_path / "said.yaml").write_text(said, encoding="utf-8")
        config = load(tmp_path / "said.yaml")
        assert {e.voltage_V for e in ingest(config.rig, config.control.signal(), tmp_path).entries} == levels


def test_a_number_before_a_symbol_is_no_level_and_the_one_behind_it_is_asked_for_its_unit(tmp_path: Path) -> None:
    """Of `Test 1 V=0` the number of the test was 1 V."""
    for number, level in ((1, 0), (2, 100)):
        write(tmp_path / f"Test {number} V={level}.csv", lines(PLAIN))
    said = "\n".join(guessed(sorted(tmp_path.glob("*.csv"))))
    asked = "voltage:   # fill in: the unit of voltage in the files' names"
    assert asked in said
    (tmp_path / "guess.yaml").write_text(said.replace(asked, "voltage: V"), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    assert {e.voltage_V for e in ingest(config.rig, config.control.signal(), tmp_path).entries} == {0.0, 100.0}


def test_a_doubtful_level_is_asked_for_beside_a_temperature_too(tmp_path: Path) -> None:
    """The question was lost where the names held a temperature, and both levels were read as one."""
    for level in ("0", "100"):
        write(tmp_path / f"D1_{level}V_35C.csv", lines(PLAIN))
    text = guessed(sorted(tmp_path.glob("*.csv")))
    (asked,) = (line for line in text if "pattern:" in line)
    answer = re.findall(r"'(\(\?P[^']+)'", asked)[-1]
    said = "\n".join(text).replace("pattern: ''", f"pattern: '{answer}'")
    (tmp_path / "said.yaml").write_text(said, encoding="utf-8")
    config = load(tmp_path / "said.yaml")
    entries = ingest(config.rig, config.control.signal(), tmp_path).entries
    assert [(e.voltage_V, e.temperature_degC) for e in entries] == [(0.0, 35.0), (100.0, 35.0)]


def test_levels_in_the_names_of_folders_are_constants_of_their_files(tmp_path: Path) -> None:
    for level in ("0mA", "500mA"):
        for number in (1, 2):
            write(tmp_path / level / f"r{number}.csv", lines(PLAIN))
    (tmp_path / "guess.yaml").write_text("\n".join(guessed(sorted(tmp_path.glob("*/*.csv")))), encoding="utf-8")
    config = load(tmp_path / "guess.yaml")
    entries = ingest(config.rig, config.control.signal(), tmp_path).entries
    assert [e.voltage_V for e in entries] == [0.0, 0.0, 0.5, 0.5]


@pytest.mark.parametrize(
    ("name", "pattern", "remedy"),
    [
        ("b_1,5V", r"(?P<voltage>[0-9]+)V", r"(?P<voltage>-?[0-9.,xp]+)V"),
        ("b_1.5V", r"_(?P<voltage>[0-9]+)", r"_(?P<voltage>-?[0-9.,xp]+)"),
        ("b_15V", r"(?P<voltage>[0-9])V", r"(?P<voltage>-?[0-9.,xp]+)V"),
    ],
)
def test_a_number_that_a_pattern_cuts_is_refused(tmp_path: Path, name: str, pattern: str, remedy: str) -> None:
    write(tmp_path / f"{name}.csv", lines(PLAIN))
    more = {"units": {"voltage": "V"}}
    (said,) = wrong(tmp_path, {"path": "*.csv", "pattern": pattern, **more})
    assert "rig.files.0.pattern: voltage: only" in said
    assert "(?P<voltage>-?[0-9.,xp]+)" in said
    assert read_by(tmp_path, remedy, more) == float(name[2:-1].replace(",", "."))


def test_a_minus_behind_a_symbol_is_refused_until_the_pattern_says_what_it_is(tmp_path: Path) -> None:
    write(tmp_path / "sine_T-20C.csv", lines(PLAIN))
    more = {"units": {"temperature": "degC"}}
    (said,) = wrong(tmp_path, {"path": "*.csv", "pattern": "(?P<temperature>[0-9]+)C", **more})
    assert "temperature: the minus in front of a number is left out" in said
    assert read_by(tmp_path, "(?P<temperature>-?[0-9]+)C", more) == -20.0
    assert read_by(tmp_path, "T-(?P<temperature>[0-9]+)C", more) == 20.0


# ---------------------------------------------------------------- the name of the control signal


@pytest.mark.parametrize("name", ["u", "i", "v", "s", "U", "I"])
def test_a_control_of_one_letter_is_no_part_of_other_keys(tmp_path: Path, name: str) -> None:
    """Called u, it turned `unit` and `units` into no such key; called s, `sign`, and `gap_s` would be a voltage."""
    write(tmp_path / "a.csv", lines({**PLAIN, "signal": np.full(TIME.size, 2.0)}))
    text = f"""
control: {{name: {name}, unit: A}}
rig:
  files:
    - path: a.csv
      columns: {{{name}: signal}}
      units: {{{name}: A}}
      sign: {{{name}: -1}}
      split: {{gap_s: 3}}
  limits: {{{name}_A: [0, 3]}}
"""
    (tmp_path / "c.yaml").write_text(text, encoding="utf-8")
    config = load(tmp_path / "c.yaml")
    (entry,) = ingest(config.rig, config.control.signal(), tmp_path).entries
    assert entry.voltage_V == -2.0
    assert config.rig.limits.voltage_V == (0.0, 3.0)


@pytest.mark.parametrize("name", ["u", "i", "v", "s", "current", "rebound_clicks"])
def test_keys_go_to_the_name_of_a_control_and_back(name: str) -> None:
    control = Control(name, "A")
    for key in all_keys():
        assert canonical(control.renamed(key), control) == key
        assert "voltage" in key or canonical(key, control) == key


@pytest.mark.parametrize("name", ["k", "T0", "C", "n", "F", "unit", "units", "sign", "setting", "gas_spring"])
def test_a_control_called_as_a_key_or_a_parameter_is_refused(tmp_path: Path, name: str) -> None:
    write(tmp_path / "a.csv", lines(CANONICAL))
    rest = "rig:\n  files:\n    - path: a.csv\n      columns: {voltage: voltage_V}\n      units: {voltage: A}\n"
    (tmp_path / "c.yaml").write_text(f"control: {{name: {name}, unit: A}}\n{rest}", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load(tmp_path / "c.yaml")
    (said,) = caught.value.messages
    assert f"c.yaml:1:17: control.name: {name} is a key or a parameter of pzd" in said
    proposed = said.partition("e.g. ")[2].partition(" ")[0]
    (tmp_path / "c.yaml").write_text(f"control: {{name: {proposed}, unit: A}}\n{rest}", encoding="utf-8")
    assert load(tmp_path / "c.yaml").control.name == proposed
