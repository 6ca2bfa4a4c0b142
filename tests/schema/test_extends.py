"""A config that extends another: what it says goes over it, every value keeps its place, and circles are refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from pzd.config import RunConfig, load
from pzd.pipeline.command import opened, resolved
from pzd.schema.errors import ConfigError

BASE = "seed: 3\nrig: {files: [{path: a.csv}, {path: b.csv}]}\ntable: {speed_points: 12, outside: clamp}\n"


def write(folder: Path, own: str, base: str = BASE) -> Path:
    (folder / "base.yaml").write_text(base, encoding="utf-8")
    path = folder / "own.yaml"
    path.write_text(own, encoding="utf-8")
    return path


def read(folder: Path, own: str, base: str = BASE) -> RunConfig:
    return load(write(folder, own, base))


def test_nothing_beside_extends_is_the_other_config(tmp_path: Path) -> None:
    assert read(tmp_path, "extends: base.yaml\n") == load(tmp_path / "base.yaml")


def test_mappings_are_put_together_and_lists_replaced(tmp_path: Path) -> None:
    own = "extends: base.yaml\ntable: {outside: model}\nrig: {files: [{path: c.csv}]}\n"
    config = read(tmp_path, own)
    assert (config.seed, config.table.speed_points, config.table.outside) == (3, 12, "model")
    assert config.rig.files is not None
    assert [entry.path for entry in config.rig.files] == ["c.csv"]


def test_one_may_extend_one_that_extends_a_third(tmp_path: Path) -> None:
    (tmp_path / "first.yaml").write_text("extends: own.yaml\nseed: 5\n", encoding="utf-8")
    write(tmp_path, "extends: base.yaml\nseed: 4\ntable: {outside: error}\n")
    config = load(tmp_path / "first.yaml")
    assert (config.seed, config.table.outside, config.table.speed_points) == (5, "error", 12)


def test_the_command_line_goes_over_both(tmp_path: Path) -> None:
    assert load(write(tmp_path, "extends: base.yaml\nseed: 4\n"), ["seed=9"]).seed == 9


def test_each_value_and_each_mistake_has_the_place_in_its_own_file(tmp_path: Path) -> None:
    path = write(tmp_path, "extends: base.yaml\nseed: 4\n")
    origin = {one.path: one.origin for one in resolved(opened(path, tmp_path))}
    assert origin["seed"] == f"{path}:2:7"
    assert origin["table.outside"] == f"{tmp_path / 'base.yaml'}:3:36"
    with pytest.raises(ConfigError, match=r"base\.yaml:3:9: table\.speed_pionts: no such key; did you mean"):
        read(tmp_path, "extends: base.yaml\n", BASE.replace("points", "pionts"))


@pytest.mark.parametrize(
    ("own", "message"),
    [
        ("extends: own.yaml\n", r"own\.yaml:1:10: extends: a config that extends itself never ends"),
        ("extends: ../base.yaml\n", r"own\.yaml:1:10: extends: must be the name of a config beside this one"),
        ("extends: 3\n", r"own\.yaml:1:10: extends: must be the name"),
        ("extends: bass.yaml\n", r"own\.yaml:1:10: extends: no such file in .*\(got bass\.yaml\)"),
    ],
)
def test_what_cannot_be_extended_is_refused_with_its_place(tmp_path: Path, own: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        read(tmp_path, own)


def test_a_circle_of_two_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"base\.yaml:1:10: extends: a config that extends itself never ends"):
        read(tmp_path, "extends: base.yaml\n", "extends: own.yaml\n")


def test_extends_is_no_value_to_set(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="stands in the config alone"):
        load(write(tmp_path, "extends: base.yaml\n"), ["extends=base.yaml"])
