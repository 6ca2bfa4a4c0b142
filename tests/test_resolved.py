"""`pzd show CONFIG --resolved`: every value of a config with its origin."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from pzd.config import load
from pzd.pipeline.command import opened, resolved
from pzd.schema.yamlfile import read_yaml

ROOT = Path(__file__).resolve().parent.parent
TEXT = """\
seed: 7
control: {name: current, unit: A}
rig:
  files:
    - path: a.csv
  limits: {current_A: [0, 2]}
simulate: {passive_current_A: 1}
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "c.yaml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def origins(config: Path, *overrides: str) -> dict[str, tuple[object, str]]:
    return {one.path: (one.value, one.origin) for one in resolved(opened(config, config.parent, overrides))}


def test_a_value_of_the_file_has_its_line_and_column(config: Path) -> None:
    found = origins(config)
    assert found["seed"] == (7, f"{config}:1:7")
    assert found["rig.files.0.path"] == ("a.csv", f"{config}:5:13")
    assert found["rig.limits.current_A.1"] == (2.0, f"{config}:6:27")
    assert found["simulate.passive_current_A"] == (1.0, f"{config}:7:31")


def test_what_nobody_says_is_the_default(config: Path) -> None:
    found = origins(config)
    assert found["identify.method"] == ("separable", "default")
    assert found["rig.files.0.layout"] == (None, "default")


def test_the_command_line_is_an_origin(config: Path) -> None:
    found = origins(config, "seed=8", "table.outside=clamp")
    assert found["seed"] == (8, "--set seed")
    assert found["table.outside"] == ("clamp", "--set table.outside")


def test_set_takes_every_path_that_is_printed_and_changes_nothing(config: Path) -> None:
    scalars = {path: value for path, (value, _) in origins(config).items() if not isinstance(value, list | dict)}
    given = [f"{path}={json.dumps(value)}" for path, value in scalars.items() if origins(config)[path][1] != "default"]
    assert len(given) == 7
    assert load(config, given) == load(config)


@pytest.mark.parametrize("name", ["quickstart", "utfsm", "reference"])
def test_every_value_of_a_shipped_config_is_there_once(name: str) -> None:
    path = ROOT / "configs" / f"{name}.yaml"
    found = resolved(opened(path, ROOT / "runs"))
    assert len({one.path for one in found}) == len(found)
    data = read_yaml(path).data
    assert {one.path.split(".")[0] for one in found if one.origin != "default"} <= set(data)
    assert {key for key, value in data.items() if value is not None} <= {one.path.split(".")[0] for one in found}


def test_it_needs_no_run(config: Path, pzd_here: Callable[..., CompletedProcess[str]]) -> None:
    done = pzd_here("show", config, "--resolved", "--runs", config.parent / "runs")
    assert done.returncode == 0, done.stderr
    assert any(line.split() == ["seed", "7", f"{config}:1:7"] for line in done.stdout.splitlines())
    listed = json.loads(pzd_here("show", config, "--resolved", "--json").stdout)
    assert {"path": "identify.method", "value": "separable", "origin": "default"} in listed
