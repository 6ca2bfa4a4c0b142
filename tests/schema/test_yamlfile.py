"""YAML 1.2 as configs use it: what a scalar means, where every fault stands, and that writing reads back."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field

from pzd.quantities import Control
from pzd.schema.errors import ConfigError, DataError, FilesError
from pzd.schema.model import Frozen
from pzd.schema.yamlfile import read_yaml, read_yaml_model, write_yaml_model
from pzd.schema.yamltree import scalar_of, written

VOLTAGE = Control()
CURRENT = Control("current", "A")


class Sine(Frozen):
    kind: Literal["sine"] = "sine"
    frequency_Hz: float = Field(gt=0.0)


class Sweep(Frozen):
    kind: Literal["sweep"] = "sweep"
    from_Hz: float


class Inner(Frozen):
    setting: str | None = None
    voltage_V: float | tuple[float, ...] = 0.0
    wave: Annotated[Sine | Sweep, Field(discriminator="kind")] | None = None


class Outer(Frozen):
    name: str = "a"
    outside: Literal["clamp", "error", "model"] = "model"
    inner: tuple[Inner, ...] = Field(default=(), min_length=1)
    limits: dict[str, float] = Field(default_factory=dict)


def read(tmp_path: Path, text: str | bytes, *overrides: str, control: Control = VOLTAGE) -> Outer:
    path = tmp_path / "c.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_yaml(path).overridden(overrides).validated(Outer, control)


def faults(tmp_path: Path, text: str | bytes, *overrides: str, control: Control = VOLTAGE) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, text, *overrides, control=control)
    return [message.replace(str(tmp_path / "c.yaml"), "c.yaml") for message in caught.value.messages]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("yes", "yes"),
        ("no", "no"),
        ("On", "On"),
        ("off", "off"),
        ("true", True),
        ("FALSE", False),
        ("tRue", "tRue"),
        ("~", None),
        ("Null", None),
        ("", None),
        ("1:30", "1:30"),
        ("2001-01-01", "2001-01-01"),
        ("0o17", 15),
        ("017", 17),
        ("0x1F", 31),
        ("0b11", "0b11"),
        ("1_000", "1_000"),
        ("-12", -12),
        ("1e3", 1000.0),
        (".5", 0.5),
        ("1.", 1.0),
        ("-1.5E-3", -0.0015),
        (".inf", math.inf),
        ("-.INF", -math.inf),
        ("1e", "1e"),
        ("+", "+"),
        ("<<", "<<"),
    ],
)
def test_a_plain_scalar_means_what_yaml_1_2_says(text: str, value: Any) -> None:
    found = scalar_of(text)
    assert found == value
    assert type(found) is type(value)


def test_nan_is_a_number() -> None:
    assert math.isnan(float(str(scalar_of(".nan"))))


@given(st.one_of(st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False), st.text()))
def test_a_written_scalar_reads_back_as_itself(tmp_path_factory: pytest.TempPathFactory, value: Any) -> None:
    if isinstance(value, str) and any(c == "\0" or "\ud800" <= c <= "\udfff" for c in value):
        return
    path = tmp_path_factory.getbasetemp() / "scalar.yaml"
    path.write_bytes(f"a: {written(value)}\n{written(str(value))}: 1\n".encode())
    data = read_yaml(path).data if str(value) != "a" else {"a": value, str(value): 1}
    assert data == {"a": value, str(value): 1}
    assert type(data["a"]) is type(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "c.yaml: the file is empty"),
        ("# only a comment\n", "c.yaml: the file is empty"),
        ("name: a\n---\nname: b\n", "c.yaml:2:1: a second document begins here; one is allowed"),
        ("name: a\n\tname: b\n", "c.yaml:2:1: a tab where YAML wants spaces"),
        ("name: a\nname: b\n", "c.yaml:2:1: name: the key is given a second time (first at c.yaml:1:1)"),
        ("name: !!str 1\n", "c.yaml:1:7: name: tags are not allowed; leave it out (got !!str)"),
        ("name: !foo 1\n", "c.yaml:1:7: name: tags are not allowed; leave it out (got !foo)"),
        ("name: !!python/object:os.system x\n", "c.yaml:1:7: name: tags are not allowed"),
        ("name: !foo!bar x\n", "c.yaml:1:7: found undefined tag handle"),
        ("inner: " + "[" * 101 + "]" * 101, "c.yaml:1:107: nested deeper than 100 levels"),
        ("inner: &a [*a]\n", "c.yaml:1:12: an alias inside its own anchor never ends (got *a)"),
        ("name: *a\n", "c.yaml:1:7: no anchor of this name stands before it (got *a)"),
        ("inner: {<<: 3}\n", "c.yaml:1:9: inner: << must give a mapping, such as <<: *name (got 3)"),
        ("name: {a\n", "c.yaml:1:7: the { that opens here is not closed; put } at its end"),
        ("name: a: b\n", "c.yaml:1:8: a second colon in one line; put the text in quotes"),
        ("name: \x07\n", "c.yaml:1:7: a character that YAML does not allow (got U+0007)"),
        ('name: "\\ud800"\n', "c.yaml:1:7: name: text with a character that no text has"),
        ('name: "\\0"\n', "c.yaml:1:7: name: text with a character that no text has"),
        (f"name: {'9' * 5000}\n", "c.yaml:1:7: name: a number of 5000 digits is too long"),
        ("1: a\n", "c.yaml:1:1: a key must be text; put it in quotes (got 1)"),
        ("? [a]\n: b\n", "c.yaml:1:3: a key must be text"),
        ("- a\n", 'c.yaml:1:1: must be a mapping (got ["a"])'),
        ("name\n", "c.yaml:1:1: must be a mapping (got name)"),
        (b"name: caf\xe9\n", "c.yaml:1: not UTF-8 text"),
        ("name: a\nname: b\n".encode("utf-16"), "c.yaml:1: not UTF-8 text"),
    ],
)
def test_what_is_no_such_document_is_refused_in_one_line_with_its_place(
    tmp_path: Path, text: str | bytes, message: str
) -> None:
    found = faults(tmp_path, text)
    assert len(found) == 1
    assert found[0].startswith(message)
    assert "\n" not in found[0]


def test_a_mark_of_byte_order_and_windows_line_ends_are_no_fault(tmp_path: Path) -> None:
    assert read(tmp_path, b"\xef\xbb\xbfname: b\r\ninner: [{}]\r\n").name == "b"


def test_a_hundred_levels_are_read(tmp_path: Path) -> None:
    path = tmp_path / "deep.yaml"
    path.write_text("[" * 100 + "]" * 100)
    assert read_yaml(path).data


def test_aliases_are_read_while_they_stay_small(tmp_path: Path) -> None:
    assert read(tmp_path, "inner: [&a {voltage_V: 3}, *a]\n").inner == (Inner(voltage_V=3.0),) * 2


def test_a_merge_key_adds_what_a_mapping_does_not_say_itself(tmp_path: Path) -> None:
    path = tmp_path / "merged.yaml"
    path.write_text(
        "a: &a {p: 1, q: 2}\nb: &b {q: 3, r: 4}\n"
        "first: {q: 5, <<: *a}\nlast: {<<: *a, q: 5}\nboth: {<<: [*a, *b], s: 6}\nquoted: {'<<': 7}\n"
    )
    data = read_yaml(path).data
    assert data["first"] == data["last"] == {"p": 1, "q": 5}
    assert data["both"] == {"p": 1, "q": 2, "r": 4, "s": 6}
    assert data["quoted"] == {"<<": 7}


def test_a_bomb_of_aliases_is_refused_before_it_goes_off(tmp_path: Path) -> None:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 30)]
    (found,) = faults(tmp_path, "\n".join(lines))
    assert "aliases that give more than 1000000 values" in found


def test_a_missing_file_and_a_folder_are_wrong_configs(tmp_path: Path) -> None:
    for path in (tmp_path / "absent.yaml", tmp_path, tmp_path / "absent" / "c.yaml"):
        with pytest.raises(ConfigError, match=path.name):
            read_yaml(path)


def test_a_file_that_may_not_be_read_is_a_fault_of_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(FilesError, match="Permission denied"):
        read_yaml(tmp_path / "c.yaml")


def test_every_fault_is_reported_at_once_with_the_nearest_key(tmp_path: Path) -> None:
    text = "nmae: b\noutside: clmap\ninner:\n  - {voltage: 3, setting: 1}\n  - voltage_V: [1, x]\n"
    text += "limits: {a: true}\nzzz: 1\n"
    assert faults(tmp_path, text) == [
        "c.yaml:1:1: nmae: no such key; did you mean name? (got nmae)",
        "c.yaml:2:10: outside: must be one of clamp, error, model; did you mean clamp? (got clmap)",
        "c.yaml:4:6: inner.0.voltage: no such key; did you mean voltage_V? (got voltage)",
        "c.yaml:4:27: inner.0.setting: must be text; put it in quotes (got 1)",
        "c.yaml:5:20: inner.1.voltage_V.1: must be a number (got x)",
        "c.yaml:6:13: limits.a: must be a number (got true)",
        "c.yaml:7:1: zzz: no such key; there is name, outside, inner, limits (got zzz)",
    ]


@pytest.mark.parametrize(
    ("wave", "message"),
    [
        (
            "{kind: sinus, frequency_Hz: 1}",
            "c.yaml:1:23: inner.0.wave.kind: must be one of sine, sweep; did you mean sine?",
        ),
        ("{frequency_Hz: 1}", "c.yaml:1:16: inner.0.wave.kind: must be one of"),
        ("{kind: sine}", "c.yaml:1:16: inner.0.wave.frequency_Hz: is missing"),
        ("{kind: sine, frequency_Hz: -1}", "c.yaml:1:43: inner.0.wave.frequency_Hz: must be greater than 0 (got -1)"),
        ("{kind: sine, frequency_Hz: .inf}", "c.yaml:1:43: inner.0.wave.frequency_Hz: must be a finite number"),
        ("{kind: sweep, from: 1, from_Hz: 2}", "c.yaml:1:30: inner.0.wave.from: no such key; did you mean from_Hz?"),
        (
            "{kind: sine, frequency_Hz: 1, from_Hz: 2}",
            "c.yaml:1:46: inner.0.wave.from_Hz: no such key; there is kind, frequency_Hz (got from_Hz)",
        ),
        ("3", "c.yaml:1:16: inner.0.wave: must be a mapping"),
    ],
)
def test_a_fault_inside_one_kind_of_block_is_placed_where_it_stands(tmp_path: Path, wave: str, message: str) -> None:
    found = faults(tmp_path, f"inner: [{{wave: {wave}}}]\n")
    assert len(found) == 1
    assert found[0].startswith(message)


def test_a_value_that_several_types_may_take_gets_one_message(tmp_path: Path) -> None:
    assert faults(tmp_path, "inner: [{voltage_V: x}]\n") == [
        "c.yaml:1:21: inner.0.voltage_V: must be a number or a list (got x)"
    ]


def test_a_list_that_is_too_short_is_reported_and_one_with_a_faulty_item_is_not_called_short(tmp_path: Path) -> None:
    assert len(faults(tmp_path, "inner: []\n")) == 1
    assert all("at least" not in message for message in faults(tmp_path, "inner: [{voltage_V: x}]\n"))


def test_overrides_apply_to_the_document(tmp_path: Path) -> None:
    text = "inner: [{}, {}]\n"
    found = read(tmp_path, text, "inner.1.voltage_V=3", "inner.1.setting='7'", "limits.a=1e3", "name=x", "name=y")
    assert found.inner[1] == Inner(voltage_V=3.0, setting="7")
    assert found.limits == {"a": 1000.0}
    assert found.name == "y"
    assert found.inner[0] == Inner()


def test_an_override_of_an_aliased_block_changes_this_place_only(tmp_path: Path) -> None:
    found = read(tmp_path, "inner: [&a {voltage_V: 3}, *a]\n", "inner.0.voltage_V=4")
    assert [one.voltage_V for one in found.inner] == [4.0, 3.0]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("outside=clmap", "--set outside: must be one of clamp, error, model; did you mean clamp? (got clmap)"),
        ("outsid=clamp", "--set outsid: no such key; did you mean outside? (got outsid)"),
        ("inner.3.setting=a", "--set inner.3.setting: the list here has 1 item, counted from 0 (got 3)"),
        ("inner.x=a", "--set inner.x: the list here has 1 item"),
        ("name.x=a", "--set name.x: a single value stands before x, it has no keys (got b)"),
        ("name=[[1]]", "--set name: VALUE must be one YAML scalar, or a list of them: [a, b] (got [[1]])"),
        ("name=a: b", "--set name: VALUE must be one YAML scalar, or a list of them: [a, b] (got a: b)"),
        ("name=*x", "--set name: VALUE must be one YAML scalar; put text in quotes"),
        ("name", "--set name: must read a.b=VALUE (got name)"),
        ("=1", "--set =1: must read a.b=VALUE"),
        ("inner..x=1", "--set inner..x=1: must read a.b=VALUE"),
        ("name=", "--set name: must be text (got null)"),
        ("inner.0.voltage_V=x", "--set inner.0.voltage_V: must be a number or a list (got x)"),
    ],
)
def test_a_faulty_override_is_named_as_it_was_typed(tmp_path: Path, override: str, message: str) -> None:
    found = faults(tmp_path, "name: b\ninner: [{}]\n", override)
    assert len(found) == 1
    assert found[0].startswith(message)


def test_a_list_of_scalars_is_one_value_of_an_override(tmp_path: Path) -> None:
    assert read(tmp_path, "inner: [{}]\n", "inner.0.voltage_V=[3, 4]").inner[0].voltage_V == (3.0, 4.0)


def test_faulty_overrides_are_reported_at_once(tmp_path: Path) -> None:
    assert len(faults(tmp_path, "inner: [{}]\n", "a", "b", "inner.9=1")) == 3


def test_keys_of_the_control_bear_its_own_name(tmp_path: Path) -> None:
    text = "inner: [{current_A: 2}]\n"
    assert read(tmp_path, text, control=CURRENT).inner[0].voltage_V == 2.0
    assert faults(tmp_path, text) == [
        "c.yaml:1:10: inner.0.current_A: no such key; there is setting, voltage_V, wave (got current_A)"
    ]
    assert faults(tmp_path, "inner: [{curent_A: 2}]\n", control=CURRENT) == [
        "c.yaml:1:10: inner.0.curent_A: no such key; did you mean current_A? (got curent_A)"
    ]
    assert faults(tmp_path, "inner: [{current_A: x}]\n", control=CURRENT) == [
        "c.yaml:1:21: inner.0.current_A: must be a number or a list (got x)"
    ]


def test_the_control_by_both_its_names_is_refused(tmp_path: Path) -> None:
    assert len(faults(tmp_path, "inner: [{current_A: 2, voltage_V: 3}]\n", control=CURRENT)) == 1


@pytest.mark.parametrize("control", [VOLTAGE, CURRENT])
def test_a_written_model_reads_back_equal_and_writes_the_same_bytes_again(tmp_path: Path, control: Control) -> None:
    model = Outer(
        name="no # comment: 'quoted'",
        inner=(Inner(setting="gap 0.25 mm", voltage_V=(0.1 + 0.2, 1e-300, -0.0)), Inner(wave=Sine(frequency_Hz=1e16))),
        limits={"1": 1.0, "a b": 2.0, "": 3.0, "~": 4.0},
    )
    path, again = tmp_path / "a.yaml", tmp_path / "b.yaml"
    write_yaml_model(path, model, control)
    found = read_yaml_model(path, Outer, control)
    assert found == model
    write_yaml_model(again, found, control)
    assert path.read_bytes() == again.read_bytes()


def test_a_written_model_is_laid_out_to_be_read(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    write_yaml_model(path, Outer(inner=(Inner(voltage_V=(0.0, 150.0)), Inner(wave=Sine(frequency_Hz=2.0)))), VOLTAGE)
    assert path.read_text().splitlines() == [
        "name: a",
        "outside: model",
        "inner:",
        "  - setting: null",
        "    voltage_V: [0.0, 150.0]",
        "    wave: null",
        "  - setting: null",
        "    voltage_V: 0.0",
        "    wave:",
        "      kind: sine",
        "      frequency_Hz: 2.0",
        "limits: {}",
    ]


def test_an_artefact_at_fault_is_a_fault_of_the_data(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("inner: [{voltage_V: x}]\n")
    with pytest.raises(DataError, match=r"a.yaml:1:21: inner.0.voltage_V"):
        read_yaml_model(path, Outer, VOLTAGE)
    path.write_text("inner: [{voltage_V: 1}]\n")
    with pytest.raises(DataError, match=r"a.yaml:1:10: voltage_V: must be called current_A here"):
        read_yaml_model(path, Outer, CURRENT)
