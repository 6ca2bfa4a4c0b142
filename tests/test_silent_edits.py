"""Configs and hand edits in which a number stands in another unit, twice, or against another one: told, not taken."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pzd.artefacts import Diagnosed, Identified, ParameterRow, RecordEntry, Rig, Value
from pzd.config import load
from pzd.damper.model import BaseRow, Damper
from pzd.identification.config import GroupConfig, IdentifyConfig
from pzd.identification.stage import identify
from pzd.pipeline.command import opened, preflight
from pzd.quantities import Control
from pzd.record import Record, merged_voltages
from pzd.report.diagnosis_text import diagnosis_lines
from pzd.rig.config import FilesEntry, FileSplit
from pzd.rig.files.reading import listed
from pzd.schema.errors import ConfigError, DataError

Written = Identified | Rig | Diagnosed
Edit = Callable[[str], str]

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
        (VIRTUAL, "damper.base.1: another row before it has the same voltage and temperature"),
    ],
)
def test_a_config_that_cannot_be_meant_so_is_refused(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "lab.yaml").write_text(text)
    with pytest.raises(ConfigError) as refused:
        load(tmp_path / "lab.yaml")
    assert told in refused.value.messages[0], refused.value.messages


def replaced(old: str, new: str) -> Edit:
    def edit(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    return edit


def edited(artefact: Written, folder: Path, file: str, edit: Edit) -> Written:
    """The artefact read back after an edit of one of its files."""
    artefact.write(folder, Control())
    path = folder / file
    path.write_text(edit(path.read_text()))
    return type(artefact).read(folder, Control())


def refusal(artefact: Written, folder: Path, file: str, edit: Edit) -> str:
    """What is told of an artefact that is refused after such an edit."""
    with pytest.raises(DataError) as refused:
        edited(artefact, folder, file, edit)
    return "\n".join(refused.value.messages)


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
        (replaced(",300.0,", ",0.3,"), "T0_N must lie between T0_N_low95 and T0_N_high95"),
        (replaced(",2600.0,", ",26000.0,"), "C_Ns_per_m must lie between C_Ns_per_m_low95"),
        (
            replaced(",200000.0,190000.0,210000.0,", ",0.2,,,"),
            "csv:2: k_N_per_m: must be at least 1 N/m, as that of every damper",
        ),
        (lambda text: text + text.splitlines()[1] + "\n", "two rows of one condition"),
    ],
)
def test_parameters_edited_by_hand_are_held_against_their_intervals_and_stand_once(
    tmp_path: Path, edit: Edit, told: str
) -> None:
    assert told in refusal(identified(), tmp_path, "parameters.csv", edit)


def test_a_parameter_edited_by_hand_may_go_without_its_interval(tmp_path: Path) -> None:
    found = edited(identified(), tmp_path, "parameters.csv", replaced(",300.0,290.0,310.0,", ",450.0,,,"))
    assert isinstance(found, Identified)
    assert found.rows[0].T0_N == 450.0


def rig() -> Rig:
    time = np.arange(512) / 128.0
    phase = 7.0 * time
    motion = 0.02 * np.sin(phase), 0.14 * np.cos(phase), -0.98 * np.sin(phase)
    record = Record("r0", None, time, *motion, 1e3 * np.cos(phase) + 40.0, np.full(time.size, 50.0))
    entry = RecordEntry(name="r0", setting=None, voltage_V=50.0, temperature_degC=None, rate_Hz=128.0, cycles=4.0)
    return Rig((record,), (entry,))


def with_spike_removed(text: str) -> str:
    header, *rows = [line.split(",") for line in text.splitlines()]
    rows[7][4] = "925.0"
    return "".join(",".join(row) + "\n" for row in (header, *rows))


def row_twice(text: str) -> str:
    lines = text.splitlines()
    return "\n".join([*lines[:9], lines[8], *lines[9:]]) + "\n"


def test_an_edited_record_is_used_as_it_stands(tmp_path: Path) -> None:
    found = edited(rig(), tmp_path, "r0.csv", with_spike_removed)
    assert isinstance(found, Rig)
    assert found.records[0].force[7] == 925.0


def test_a_record_whose_time_does_not_increase_after_an_edit_is_refused(tmp_path: Path) -> None:
    told = "r0.csv:10: time does not increase: 0.0546875 s after 0.0546875 s"
    assert told in refusal(rig(), tmp_path, "r0.csv", row_twice)


def test_an_entry_renamed_by_hand_has_no_file(tmp_path: Path) -> None:
    assert "r1.csv" in refusal(rig(), tmp_path, "records.json", replaced('"name": "r0"', '"name": "r1"'))


def diagnosed() -> Diagnosed:
    plain = Damper(base=(BaseRow(voltage_V=0.0, T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),))
    damper = plain.with_effect("gas_spring", {"k_g": 5000.0}).with_effect("preload_offset", {"F_0": 80.0})
    stiffness = Value(value=5000.0, low95=4900.0, high95=5100.0, unit="N/m")
    offset = Value(value=80.0, low95=70.0, high95=90.0, unit="N")
    parameters = {
        "gas_spring": {"k_g": stiffness},
        "preload_offset": {"F_0": offset},
    }
    told = {"effects": tuple(damper.effects), "parameters": parameters}
    return Diagnosed(Diagnosed.undiagnosed(plain).diagnosis.model_copy(update=told), damper, plain, identified().rows)


OUT_OF_ANY_DAMPER = [
    ("k_N_per_m: 200000.0", "k_N_per_m: 0.2", "yaml:6:16: base.0.k_N_per_m: must be at least 1 N/m"),
    ("k_N_per_m: 200000.0", "k_N_per_m: -2e+5", "base.0.k_N_per_m: must be"),
    ("C_Ns_per_m: 2700.0", "C_Ns_per_m: 2.7e+09", "must lie between 0 and 1e+09 N s/m"),
    ("T0_N: 300.0", "T0_N: 3e+9", "T0_N: must lie between 0 and 1e+08 N, as that of every damper"),
]
OF_NO_SUCH_EFFECT = [
    ("gas_spring:", "gas_sprin:", "no effect is called gas_sprin; did you mean gas_spring?"),
    ("k_g: 5000.0", "k_gas: 5000.0", "gas_spring takes k_g (got k_gas)"),
    (
        "effects:\n",
        "effects:\n  lash:\n    delta: 0.001\n",
        "yaml: effects: must be those of diagnosis.json and plain.yaml, gas_spring, preload_offset (got lash, gas",
    ),
]
"""What is edited in damper.yaml, and the refusal."""


@pytest.mark.parametrize(("old", "new", "told"), OUT_OF_ANY_DAMPER + OF_NO_SUCH_EFFECT)
def test_a_damper_edited_to_values_that_no_damper_has_or_to_other_effects_is_refused(
    tmp_path: Path, old: str, new: str, told: str
) -> None:
    assert told in refusal(diagnosed(), tmp_path, "damper.yaml", replaced(old, new))


def test_a_plain_damper_edited_to_what_no_damper_has_is_refused(tmp_path: Path) -> None:
    for number, (old, new, told) in enumerate(OUT_OF_ANY_DAMPER):
        (folder := tmp_path / str(number)).mkdir()
        assert told in refusal(diagnosed(), folder, "plain.yaml", replaced(old, new))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            '"gas_spring",',
            '"gas_spring", "lash",',
            "damper.yaml: effects: must be those of diagnosis.json and plain.yaml",
        ),
        ('"gas_spring",', "", "diagnosis.json and plain.yaml, preload_offset (got gas_spring, preload_offset)"),
        ('"low95": 4900.0', '"low95": 49000.0', "value must lie between low95 and high95; change them too"),
        ('"low95": 4900.0', '"low95": [4900.0]', "must be lists of one length, or no lists"),
    ],
)
def test_a_diagnosis_edited_to_contradict_itself_or_its_damper_is_refused(
    tmp_path: Path, old: str, new: str, told: str
) -> None:
    assert told in refusal(diagnosed(), tmp_path, "diagnosis.json", replaced(old, new))


def test_a_damper_edited_to_other_values_that_a_damper_may_have_is_taken(tmp_path: Path) -> None:
    found = edited(
        diagnosed(), tmp_path, "damper.yaml", lambda text: text.replace("300.0", "0.0").replace("2700", "9000")
    )
    assert isinstance(found, Diagnosed)
    assert (found.damper.base[0].T0_N, found.damper.base[0].C_Ns_per_m) == (0.0, 9000.0)


@pytest.mark.parametrize("value", [8000.0, 5.0, -6000.0])
def test_a_value_of_an_effect_edited_in_the_damper_is_used_and_reported_as_edited(tmp_path: Path, value: float) -> None:
    found = edited(diagnosed(), tmp_path, "damper.yaml", replaced("k_g: 5000.0", f"k_g: {value}"))
    assert isinstance(found, Diagnosed)
    assert found.damper.effects["gas_spring"]["k_g"] == value
    lines = diagnosis_lines(found.diagnosis, Control())
    assert f"adopted: gas_spring, k_g = {value:g} N/m (edited by hand)" in lines
    assert "adopted: preload_offset, F_0 = 80 (70 to 90) N" in lines


def test_a_value_against_nature_that_was_diagnosed_so_is_read_back(tmp_path: Path) -> None:
    """A fit may find what only looks like its effect, and says so in the reason."""
    odd = diagnosed()
    stiffness = Value(value=-500.0, low95=-600.0, high95=-400.0, unit="N/m")
    told = odd.diagnosis.model_copy(
        update={"parameters": {"gas_spring": {"k_g": stiffness}}, "effects": ("gas_spring",)}
    )
    found = Diagnosed(told, odd.baseline.with_effect("gas_spring", {"k_g": -500.0}), odd.baseline, odd.parameters)
    assert edited(found, tmp_path, "damper.yaml", str)


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
    cuts = [FileSplit(column="damper"), FileSplit(gap_s=2.0)]
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


def test_the_check_refuses_such_a_group_too(tmp_path: Path) -> None:
    config = tmp_path / "lab.yaml"
    two = VIRTUAL.replace("{voltage_V: 0, T0_N: 6", "{voltage_V: 150, T0_N: 6").replace("[0]", "[0, 150]")
    config.write_text(two)
    assert len(preflight(opened(config, tmp_path)).entries) == 2
    config.write_text(f"{two}identify: {{group: {{voltage_V: 1000}}}}\n")
    with pytest.raises(ConfigError, match=r"lab\.yaml:9:31: identify\.group\.voltage_V: merges every"):
        preflight(opened(config, tmp_path))


def test_a_group_may_hold_what_scatters_about_one_voltage_or_some_of_several() -> None:
    assert merged_voltages(at_voltages(4.8, 5.0, 5.2).records, 1.0) is None
    assert merged_voltages(at_voltages(0.0, 50.0, 150.0).records, 60.0) is None
