"""Configs and hand edits in which a number stands in another unit, twice, or against another one: told, not taken."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pzd.artefacts import Diagnosed, Identified, ParameterRow, RecordEntry, Rig, extent
from pzd.config import load
from pzd.damper.model import BaseRow, Damper
from pzd.identify.config import GroupConfig, IdentifyConfig
from pzd.identify.stage import identify
from pzd.quantities import Control
from pzd.record import Record, merged_voltages
from pzd.rig.config import FilesEntry, Split
from pzd.rig.files.listing import listed
from pzd.schema.errors import ConfigError, DataError

FILES = "rig:\n  files:\n    - path: data/*.csv\n"
VIRTUAL = """rig:
  virtual:
    - damper:
        base:
          - {voltage_V: 0, T0_N: 300, C_Ns_per_m: 2700, k_N_per_m: 2.0e+5}
          - {voltage_V: 0, T0_N: 600, C_Ns_per_m: 2700, k_N_per_m: 2.0e+5}
      voltages_V: [0]
      tests: [{waveform: {kind: sine, frequency_Hz: 2, amplitude_m: 0.02}, duration_s: 6}]
"""


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (FILES + "  limits: {stroke_m: 50}\n", "rig.limits.stroke_m: must be less than or equal to 1 (got 50)"),
        (FILES + "  limits: {speed_m_per_s: 600}\n", "rig.limits.speed_m_per_s: must be less than or equal to 10"),
        (FILES + "identify: {nodes: [150, 0, 100]}\n", "identify.nodes: nodes must rise from one to the next"),
        (FILES + "identify: {nodes: [0, 0, 100]}\n", "identify.nodes: nodes must rise from one to the next"),
        (FILES + "identify: {nuisance: {gain: 2}}\n", "identify.nuisance.gain: must be less than or equal to 0.5"),
        (FILES + "diagnose: {nuisance: {offset: 1}}\n", "diagnose.nuisance.offset: must be less than or equal to 0.5"),
        (FILES + "diagnose: {nuisance: {delay_s: 0.5}}\n", "diagnose.nuisance.delay_s: must be less than or equal"),
        (FILES + "diagnose: {visible: 0.25}\n", "diagnose.visible: must be less than or equal to 0.1 (got 0.25)"),
        (FILES + "diagnose: {force: [lash], forbid: [lash]}\n", "force and forbid contradict each other on lash"),
        (FILES + "diagnose: {forbid: [lash, lash]}\n", "diagnose.forbid: one is named twice"),
        (VIRTUAL, "two rows of damper.base have the same voltage and temperature"),
    ],
)
def test_a_config_that_cannot_be_meant_so_is_refused(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "lab.yaml").write_text(text)
    with pytest.raises(ConfigError) as refused:
        load(tmp_path / "lab.yaml")
    assert told in refused.value.messages[0], refused.value.messages


def identified() -> Identified:
    row = ParameterRow(
        setting=None,
        voltage_V=0.0,
        temperature_degC=None,
        T0_N=300.0,
        T0_N_low95=290.0,
        T0_N_high95=310.0,
        C_Ns_per_m=2700.0,
        C_Ns_per_m_low95=2600.0,
        C_Ns_per_m_high95=2800.0,
        k_N_per_m=2e5,
        k_N_per_m_low95=1.9e5,
        k_N_per_m_high95=2.1e5,
        W_s=0.001,
        rmse_N=5.0,
        status="ok",
    )
    return Identified((row,), ())


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        (lambda text: text.replace(",300.0,", ",0.3,"), "T0_N must lie between T0_N_low95 and T0_N_high95"),
        (lambda text: text.replace(",2600.0,", ",26000.0,"), "C_Ns_per_m must lie between C_Ns_per_m_low95"),
        (lambda text: text + text.splitlines()[1] + "\n", "two rows of one condition"),
    ],
)
def test_parameters_edited_by_hand_are_held_against_their_intervals_and_stand_once(
    tmp_path: Path, edit: Callable[[str], str], told: str
) -> None:
    identified().write(tmp_path, Control())
    path = tmp_path / "parameters.csv"
    path.write_text(edit(path.read_text()))
    with pytest.raises(DataError) as refused:
        Identified.read(tmp_path, Control())
    assert told in refused.value.messages[0], refused.value.messages


def test_a_parameter_edited_by_hand_may_go_without_its_interval(tmp_path: Path) -> None:
    identified().write(tmp_path, Control())
    path = tmp_path / "parameters.csv"
    path.write_text(path.read_text().replace(",300.0,290.0,310.0,", ",450.0,,,"))
    assert Identified.read(tmp_path, Control()).rows[0].T0_N == 450.0


def rig() -> Rig:
    time = np.arange(128) / 128.0
    swing = 0.02 * np.sin(7.0 * time)
    force = 1e3 * np.cos(7.0 * time) + 40.0
    record = Record("r0", None, time, swing, np.gradient(swing, time), 0.0 * time, force, np.full(128, 50.0))
    entry = RecordEntry(name="r0", setting=None, cycles=1.0, **extent(record))
    return Rig((record,), (entry,))


def told_of_the_rig(folder: Path) -> str:
    with pytest.raises(DataError) as refused:
        Rig.read(folder, Control())
    return "\n".join(refused.value.messages)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            '"voltage_V": 50.0',
            '"voltage_V": 150.0',
            "records.json:5:18: voltage_V of r0: must be the median of its file (got 150.0",
        ),
        ('"temperature_degC": null', '"temperature_degC": 60.0', "temperature_degC of r0: must be the median of its"),
        ('"rate_Hz": 128.0', '"rate_Hz": 256.0', "rate_Hz of r0: must be that of its file (got 256.0"),
    ],
)
def test_a_number_edited_in_the_list_of_records_alone_is_told(tmp_path: Path, old: str, new: str, told: str) -> None:
    rig().write(tmp_path, Control())
    assert Rig.read(tmp_path, Control()).entries == rig().entries
    listed = tmp_path / "records.json"
    assert old in listed.read_text()
    listed.write_text(listed.read_text().replace(old, new))
    assert told in told_of_the_rig(tmp_path)


@pytest.mark.parametrize(
    ("column", "factor", "told"),
    [
        (1, 1e3, "displacement_rms_m of r0: must be that of its file (got 0.0"),
        (1, -1.0, "work_J of r0: must be that of its file"),
        (2, 1e3, "velocity_rms_m_per_s of r0: must be that of its file"),
        (4, 1e-3, "force_rms_N of r0: must be that of its file"),
        (4, -1.0, "work_J of r0: must be that of its file"),
        (0, 1e3, "rate_Hz of r0: must be that of its file (got 128.0"),
    ],
)
def test_a_column_of_a_record_edited_to_another_unit_or_sign_is_told(
    tmp_path: Path, column: int, factor: float, told: str
) -> None:
    rig().write(tmp_path, Control())
    path = tmp_path / "r0.csv"
    header, *rows = [line.split(",") for line in path.read_text().splitlines()]
    for row in rows:
        row[column] = repr(factor * float(row[column]))
    path.write_text("".join(",".join(row) + "\n" for row in (header, *rows)))
    assert told in told_of_the_rig(tmp_path)


def test_a_spike_taken_out_by_hand_is_no_contradiction(tmp_path: Path) -> None:
    rig().write(tmp_path, Control())
    path = tmp_path / "r0.csv"
    header, *rows = [line.split(",") for line in path.read_text().splitlines()]
    rows[7][4] = repr(0.5 * (float(rows[6][4]) + float(rows[8][4])) + 5.0)
    path.write_text("".join(",".join(row) + "\n" for row in (header, *rows)))
    assert Rig.read(tmp_path, Control()).records[0].name == "r0"


def diagnosed(*effects: str) -> Diagnosed:
    plain = Damper(base=(BaseRow(voltage_V=0.0, T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),))
    damper = plain.with_effect("gas_spring", {"k_g": 5000.0})
    told = Diagnosed.undiagnosed(plain).diagnosis.model_copy(update={"effects": ("gas_spring", *effects)})
    return Diagnosed(told, damper, plain, identified().rows)


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        (
            "damper.yaml",
            "k_N_per_m: 200000.0",
            "k_N_per_m: 0.2",
            "damper.yaml:6:16: base.0.k_N_per_m: must lie between",
        ),
        (
            "damper.yaml",
            "k_N_per_m: 200000.0",
            "k_N_per_m: 2e+14",
            "base.0.k_N_per_m: must lie between 1 and 1e+13 N/m",
        ),
        ("damper.yaml", "C_Ns_per_m: 2700.0", "C_Ns_per_m: 2.7e-05", "must lie between 0.0001 and 1e+09 N s/m"),
        ("damper.yaml", "T0_N: 300.0", "T0_N: 3e+9", "T0_N: must lie between 0 and 1e+08 N, as that of every damper"),
        ("plain.yaml", "k_N_per_m: 200000.0", "k_N_per_m: 0.2", "plain.yaml:6:16: base.0.k_N_per_m: must lie between"),
        ("damper.yaml", "C_Ns_per_m: 2700.0", "C_Ns_per_m: 2.7", "C_Ns_per_m: parameters.csv has 2700 there; is it in"),
        ("damper.yaml", "T0_N: 300.0", "T0_N: 0.3", "damper.yaml:4:11: base.0.T0_N: parameters.csv has 300 there"),
        ("damper.yaml", "gas_spring:", "gas_sprin:", "no effect is called gas_sprin; did you mean gas_spring?"),
        ("damper.yaml", "k_g: 5000.0", "k_gas: 5000.0", "gas_spring takes k_g (got k_gas)"),
        (
            "damper.yaml",
            "effects:\n",
            "effects:\n  lash:\n    delta: 0.001\n",
            "damper.yaml:9:5: effects.lash: diagnosis.json does not have it among its effects; add it there too",
        ),
        (
            "diagnosis.json",
            '"gas_spring"',
            '"gas_spring", "lash"',
            "effects.1: damper.yaml has no lash; add it there too",
        ),
        ("diagnosis.json", '"gas_spring"', "", "effects.gas_spring: diagnosis.json does not have it among its effects"),
    ],
)
def test_a_damper_edited_to_what_no_damper_has_or_nobody_diagnosed_is_refused(
    tmp_path: Path, file: str, old: str, new: str, told: str
) -> None:
    diagnosed().write(tmp_path, Control())
    assert Diagnosed.read(tmp_path, Control()).damper == diagnosed().damper
    path = tmp_path / file
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(DataError) as refused:
        Diagnosed.read(tmp_path, Control())
    assert told in refused.value.messages[0], refused.value.messages


def test_a_damper_edited_to_other_values_that_a_damper_may_have_is_taken(tmp_path: Path) -> None:
    diagnosed().write(tmp_path, Control())
    path = tmp_path / "damper.yaml"
    path.write_text(path.read_text().replace("T0_N: 300.0", "T0_N: 0.0").replace("2700.0", "9000.0"))
    base = Diagnosed.read(tmp_path, Control()).damper.base[0]
    assert (base.T0_N, base.C_Ns_per_m) == (0.0, 9000.0)


def test_a_parameter_without_its_interval_must_still_be_one_that_a_damper_has(tmp_path: Path) -> None:
    identified().write(tmp_path, Control())
    path = tmp_path / "parameters.csv"
    path.write_text(path.read_text().replace(",200000.0,190000.0,210000.0,", ",0.2,,,"))
    with pytest.raises(DataError, match=r"parameters.csv:2: k_N_per_m: must lie between 1 and 1e\+13 N/m.*got 0.2"):
        Identified.read(tmp_path, Control())


def test_a_file_under_two_settings_is_refused_with_both_entries(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    for name in ("a", "b"):
        (tmp_path / "data" / f"{name}.csv").write_text("1\n")
    soft, hard = FilesEntry(path="data/*.csv", setting="soft"), FilesEntry(path="./data/../data/?.csv", setting="hard")
    with pytest.raises(ConfigError) as refused:
        listed((soft, hard), tmp_path)
    assert refused.value.messages[0].startswith(
        "rig.files.1.path: reads a.csv and 1 more, which rig.files.0 reads too, as setting soft and hard; "
    )
    alone = listed(
        (soft.model_copy(update={"path": "data/a.csv"}), hard.model_copy(update={"path": "data/b*"})), tmp_path
    )
    assert [one.path.name for one in alone] == ["a.csv", "b.csv"]
    cuts = [Split(column="damper"), Split(gap_s=2.0)]
    assert len(listed([FilesEntry(path="data/a.csv", split=cut) for cut in cuts], tmp_path)) == 2


def at_voltages(*voltages: float) -> Rig:
    time = np.arange(128) / 128.0
    swings = [np.sin(7.0 * time + i) for i in range(4)]
    return Rig(tuple(Record(f"r{u}", None, time, *swings, np.full(100, u)) for u in voltages), ())


@pytest.mark.parametrize(
    ("control", "told"),
    [
        (Control(), "identify.group.voltage_V: merges every voltage of the rig (0 to 150 V) into one condition"),
        (Control("current", "A"), "identify.group.current_A: merges every current of the rig (0 to 150 A)"),
    ],
)
def test_a_group_that_makes_one_condition_of_all_voltages_is_refused(control: Control, told: str) -> None:
    config = IdentifyConfig(group=GroupConfig(voltage_V=1000.0))
    with pytest.raises(ConfigError) as refused:
        identify(config, at_voltages(0.0, 50.0, 150.0), seed=1, control=control)
    assert told in refused.value.messages[0]


def test_a_group_may_hold_what_scatters_about_one_voltage_or_some_of_several() -> None:
    assert merged_voltages(at_voltages(4.8, 5.0, 5.2).records, 1.0) is None
    assert merged_voltages(at_voltages(0.0, 50.0, 150.0).records, 60.0) is None
