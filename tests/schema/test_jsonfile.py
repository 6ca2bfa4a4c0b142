"""JSON artefacts read back as written, and what a person got wrong is refused with file and line."""

from __future__ import annotations

from pathlib import Path

import pytest

from pzd.quantities import Control
from pzd.schema.errors import DataError
from pzd.schema.model import Frozen
from pzd.schema.validate import read_json, read_json_list, write_json

VOLTAGE = Control()
CURRENT = Control("current", "A")


class Test(Frozen):
    __test__ = False

    name: str
    at_voltage_V: tuple[float, ...] | None = None
    size: float | tuple[float, ...] = 1.0


class Rig(Frozen):
    tests: tuple[Test, ...]


def faults(path: Path, text: str, control: Control = VOLTAGE) -> list[str]:
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DataError) as caught:
        read_json(path, Rig, control)
    return [message.replace(str(path), "r.json") for message in caught.value.messages]


@pytest.mark.parametrize("control", [VOLTAGE, CURRENT])
def test_json_that_is_written_reads_back(tmp_path: Path, control: Control) -> None:
    path = tmp_path / "r.json"
    model = Rig(tests=(Test(name="ä\n", at_voltage_V=(0.0, 0.1 + 0.2)), Test(name="b", size=(1e-300, 2.0))))
    write_json(path, model, control)
    assert read_json(path, Rig, control) == model
    assert control.renamed("at_voltage_V") in path.read_text(encoding="utf-8")
    assert path.read_bytes().endswith(b"}\n")


def test_a_list_of_models_reads_back_as_a_tuple(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    write_json(path, [Test(name="a"), Test(name="b")], CURRENT)
    assert read_json_list(path, Test, CURRENT) == (Test(name="a"), Test(name="b"))


def test_a_number_that_is_none_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError):
        write_json(tmp_path / "r.json", {"a": float("nan")}, VOLTAGE)


def test_faults_carry_line_and_column_of_the_value(tmp_path: Path) -> None:
    text = '{"tests": [\n  {"name": 5, "at_voltage_V": [1, "x"]},\n\t{"nmae": "a", "size": Infinity}\n]}\n'
    assert faults(tmp_path / "r.json", text) == [
        "r.json:2:12: tests.0.name: must be text; put it in quotes (got 5)",
        "r.json:2:35: tests.0.at_voltage_V.1: must be a number (got x)",
        'r.json:3:2: tests.1.name: is missing (got ["nmae", "size"])',
        "r.json:3:3: tests.1.nmae: no such key; did you mean name? (got nmae)",
        "r.json:3:24: tests.1.size: must be a number or a list (got Infinity)",
    ]


def test_a_key_that_stands_twice_is_refused(tmp_path: Path) -> None:
    found = faults(tmp_path / "r.json", '{"tests": [{"name": "a",\n "name": "b"}]}')
    assert found == ["r.json:2:2: tests.0.name: the key is given a second time (first at r.json:1:13)"]


def test_the_control_under_another_name_is_refused(tmp_path: Path) -> None:
    found = faults(tmp_path / "r.json", '{"tests": [{"name": "a",\n "at_voltage_V": [1]}]}', CURRENT)
    assert found == ["r.json:2:2: at_voltage_V: must be called at_current_A here (got at_voltage_V)"]
    found = faults(tmp_path / "r.json", '{"tests": [{"name": "a",\n "at_current_A": [1]}]}')
    assert found[0].startswith("r.json:2:2: tests.0.at_current_A: no such key")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "r.json:1:1: not JSON"),
        ('{"tests": [}', "r.json:1:12: not JSON"),
        ("[" * 100_000, "r.json:1:101: nested deeper than 100 levels"),
        ("[]", "r.json:1:1: must be"),
        ("null", "r.json:1:1: must be"),
    ],
)
def test_a_file_that_is_not_the_json_of_a_model_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    found = faults(tmp_path / "r.json", text)
    assert len(found) == 1
    assert found[0].startswith(message)


def test_a_missing_artefact_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"absent.json: the file is missing; run the stage again"):
        read_json(tmp_path / "absent.json", Rig, VOLTAGE)
