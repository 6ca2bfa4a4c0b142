"""The run config: the smallest one, every mistake with its place, and which setting is in use."""

from __future__ import annotations

from pathlib import Path

import pytest

from pzd.config import RunConfig, load, setting_in_use
from pzd.quantities import Control
from pzd.schema.errors import ConfigError
from pzd.schema.yamlfile import write_yaml_model

SMALLEST = "rig:\n  files:\n    - path: data/*.csv\n"


def read(tmp_path: Path, text: str, *overrides: str) -> RunConfig:
    path = tmp_path / "c.yaml"
    path.write_text(text)
    return load(path, overrides)


def faults(tmp_path: Path, text: str, *overrides: str) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, text, *overrides)
    return [message.replace(f"{tmp_path}/", "") for message in caught.value.messages]


def test_the_smallest_config_names_its_files_and_nothing_else(tmp_path: Path) -> None:
    config = read(tmp_path, SMALLEST)
    assert config.seed == 1
    assert config.setting is None
    assert config.control.signal() == Control()
    assert config.rig.files is not None
    assert config.rig.files[0].path == "data/*.csv"


def test_the_config_with_every_default_reads_back_equal(tmp_path: Path) -> None:
    for text in (SMALLEST, "control: {name: current, unit: A}\n" + SMALLEST, "car: false\n" + SMALLEST):
        config = read(tmp_path, text)
        write_yaml_model(tmp_path / "whole.yaml", config, config.control.signal())
        assert load(tmp_path / "whole.yaml") == config


def test_stages_is_read_as_the_former_spelling_of_car(tmp_path: Path) -> None:
    for stages, car in (("table, simulate, report", True), ("table, report", False)):
        former = read(tmp_path, f"stages: [rig, identify, diagnose, {stages}]\n" + SMALLEST)
        assert former == read(tmp_path, f"car: {str(car).lower()}\n" + SMALLEST)
        assert former.car is car
        write_yaml_model(tmp_path / "whole.yaml", former, Control())
        text = (tmp_path / "whole.yaml").read_text(encoding="utf-8")
        assert f"\ncar: {str(car).lower()}\n" in text
        assert "stages" not in text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{}\n", "c.yaml:1:1: say where the damper comes from: rig, or damper"),
        ("sed: 2\n" + SMALLEST, "c.yaml:1:1: sed: no such key; did you mean seed? (got sed)"),
        (SMALLEST + "      sign: {force: 2}\n", "c.yaml:4:21: rig.files.0.sign.force: must be one of 1 or -1 (got 2)"),
        ("seed: '2'\n" + SMALLEST, "c.yaml:1:7: seed: must be a whole number (got 2)"),
        ("seed: 1.5\n" + SMALLEST, "c.yaml:1:7: seed: must be a whole number (got 1.5)"),
        ("seed: true\n" + SMALLEST, "c.yaml:1:7: seed: must be a whole number (got true)"),
        ("seed: -1\n" + SMALLEST, "c.yaml:1:7: seed: must be greater than or equal to 0 (got -1)"),
        ("setting: 0.25\n" + SMALLEST, "c.yaml:1:10: setting: must be text; put it in quotes (got 0.25)"),
        (
            "table: {outside: modle}\n" + SMALLEST,
            "c.yaml:1:18: table.outside: must be one of clamp, error, model; did you",
        ),
        ("table: {outsid: model}\n" + SMALLEST, "c.yaml:1:9: table.outsid: no such key; did you mean outside?"),
        ("table: []\n" + SMALLEST, "c.yaml:1:8: table: must be a mapping"),
        ("table: {speed_max_m_per_s: .inf}\n" + SMALLEST, "c.yaml:1:28: table.speed_max_m_per_s: must be"),
        ("identify: {method: on}\n" + SMALLEST, "c.yaml:1:20: identify.method: must be one of separable, evolutionary"),
        (
            "control: {name: force, unit: N}\n" + SMALLEST,
            "c.yaml:1:17: control.name: force is another channel of the rig",
        ),
        ("control: {name: 1x}\n" + SMALLEST, "c.yaml:1:17: control.name: must match pattern"),
        ("control: {unit: ''}\n" + SMALLEST, "c.yaml:1:17: control.unit: must"),
        ("rig: {files: [{path: a, paht: b}]}\n", "c.yaml:1:25: rig.files.0.paht: no such key; did you mean path?"),
        ("rig: {files: []}\n", "c.yaml:1:14: rig.files: "),
        ("rig: {}\n", "c.yaml:1:6: rig: "),
        ("rig:\n", "c.yaml:1:1: say where the damper comes from: rig, or damper"),
    ],
)
def test_a_mistake_is_said_in_one_line_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    found = faults(tmp_path, text)
    assert len(found) == 1
    assert found[0].startswith(message)


def test_an_override_wins_over_the_file(tmp_path: Path) -> None:
    config = read(tmp_path, SMALLEST, "rig.files.0.path=X", "seed=7", "table.outside=clamp")
    assert config.rig.files is not None
    assert (config.rig.files[0].path, config.seed, config.table.outside) == ("X", 7, "clamp")


def test_the_rules_of_the_control_hold_when_it_is_overridden(tmp_path: Path) -> None:
    text = "table: {currents_A: [0, 1]}\n" + SMALLEST
    config = read(tmp_path, text, "control.name=current", "control.unit=A")
    assert config.table.voltages_V == (0.0, 1.0)
    assert faults(tmp_path, text)[0].startswith("c.yaml:1:9: table.currents_A: no such key")


@pytest.mark.parametrize(
    ("chosen", "found", "used"),
    [
        (None, [None, None], None),
        (None, ["gap", "gap"], "gap"),
        (None, [], None),
        ("gap", ["gap", "other"], "gap"),
    ],
)
def test_the_setting_in_use(chosen: str | None, found: list[str | None], used: str | None) -> None:
    assert setting_in_use(chosen, found) == used


@pytest.mark.parametrize(
    ("chosen", "found", "message"),
    [
        (None, ["gap 0.15", "gap 0.25"], "setting: the rig has several, .*: gap 0.15, gap 0.25"),
        (None, ["gap", None], "setting: the rig has several"),
        ("gap 0.24", ["gap 0.15", "gap 0.25"], r"did you mean gap 0.25\? \(got gap 0.24\)"),
        ("gap", [None], "there is none that has a name"),
    ],
)
def test_a_setting_that_is_not_clear_is_refused(chosen: str | None, found: list[str | None], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        setting_in_use(chosen, found)
