"""Configs and hand edits in which a number stands in another unit, twice, or against another one: told, not taken."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pzd.artefacts import Identified, ParameterRow, RecordEntry, Rig
from pzd.config import load
from pzd.quantities import Control
from pzd.record import Record
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


def test_a_voltage_edited_in_the_list_of_records_alone_is_told(tmp_path: Path) -> None:
    time = np.arange(100) / 100.0
    record = Record("r0", None, time, *(np.sin(time + i) for i in range(4)), np.full(100, 50.0))
    entry = RecordEntry(name="r0", setting=None, voltage_V=50.0, temperature_degC=None, rate_Hz=100.0, cycles=1.0)
    Rig((record,), (entry,)).write(tmp_path, Control())
    assert Rig.read(tmp_path, Control()).entries == (entry,)
    listed = tmp_path / "records.json"
    listed.write_text(listed.read_text().replace("50.0", "150.0"))
    with pytest.raises(DataError, match=r"voltage_V of r0: must be the median of its file \(got 150.0"):
        Rig.read(tmp_path, Control())
