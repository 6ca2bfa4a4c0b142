"""Editors complete and check a config by its first line, which names what `pzd schema` prints."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

import pytest
from jsonschema import Draft202012Validator

from pzd.cli.app import status
from pzd.config import EDITORS, SCHEMA, RunConfig
from pzd.schema.yamlfile import read_yaml

ROOT = Path(__file__).resolve().parent.parent
CONFIGS = sorted((ROOT / "configs").glob("*.yaml"))
VALIDATOR = Draft202012Validator(RunConfig.model_json_schema())


def faults(data: dict[str, Any]) -> list[str]:
    """What an editor would underline."""
    return [fault.message for fault in VALIDATOR.iter_errors(data)]


def test_the_schema_in_the_package_is_what_the_command_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert status(["schema"]) == 0
    again = "run: pzd schema > pzd/config.schema.json"
    assert SCHEMA.read_text(encoding="utf-8") == capsys.readouterr().out, again


def test_the_schema_is_one() -> None:
    Draft202012Validator.check_schema(VALIDATOR.schema)


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: config.stem)
def test_the_first_line_of_a_shipped_config_leads_to_the_schema(config: Path) -> None:
    first = config.read_text(encoding="utf-8").splitlines()[0]
    assert first.startswith(EDITORS)
    assert (config.parent / first.removeprefix(EDITORS)).resolve() == SCHEMA


@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: config.stem)
def test_an_editor_finds_nothing_wrong_with_a_shipped_config_and_a_misspelt_key(config: Path) -> None:
    data = read_yaml(config).data
    assert faults(data) == []
    assert faults({**data, "tabel": {}})


def test_keys_of_the_control_signal_go_by_any_name_and_keep_their_type() -> None:
    rig: dict[str, Any] = {"files": [{"path": "a.csv"}], "limits": {"current_A": [0, 2], "force_N": 100}}
    control = {"name": "current", "unit": "A"}
    assert faults({"control": control, "rig": rig}) == []
    assert faults({"control": control, "rig": {**rig, "limits": {"current_A": "much"}}})
    assert faults({"control": control, "rig": {**rig, "limits": {"force_N": "much"}}})


def test_the_rig_may_stand_in_the_config_that_is_extended() -> None:
    assert faults({"extends": "other.yaml"}) == []
    assert faults({"seed": 2})


def test_the_first_line_that_init_prints_names_the_installed_schema(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "test.csv").write_text("time_s,displacement_m,force_N\n0,1,2\n1,2,3\n", encoding="utf-8")
    assert status(["init", str(tmp_path / "test.csv")]) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first.startswith(f"{EDITORS}file:///")
    assert Path(unquote(urlparse(first.removeprefix(EDITORS)).path)) == SCHEMA
