"""configs/reference.yaml shows every key of a config with its default, and every alternative in it can be taken."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from pzd.cli.app import status
from pzd.config import RunConfig, load
from pzd.schema.yamlfile import read_yaml

ROOT = Path(__file__).resolve().parent.parent
REFERENCE = ROOT / "configs" / "reference.yaml"
MARK = re.compile(r"^( *)#\| ?(.*)$")
"""A line of an alternative: its indent, and what it says."""


@dataclass(frozen=True)
class Alternative:
    """Lines of the reference that stand as comments, and the keys beside them that they replace."""

    first: int
    last: int
    replaces: tuple[str, ...]


def lines() -> list[str]:
    """The reference, line by line."""
    return REFERENCE.read_text(encoding="utf-8").splitlines()


def alternatives() -> list[Alternative]:
    """Every alternative in the order of the file; the comment right above says what it replaces, if anything."""
    text, found, number = lines(), [], 0
    while number < len(text):
        if not MARK.match(text[number]):
            number += 1
            continue
        first = number
        while number < len(text) and MARK.match(text[number]):
            number += 1
        comment, above = "", first - 1
        while text[above].lstrip().startswith("# ") and "s well:" not in comment and "nstead of" not in comment:
            comment, above = f"{text[above]}\n{comment}", above - 1
        assert "As well:" in comment or "Instead of" in comment, f"line {first}: say what the alternative replaces"
        replaced = re.findall(r"`(\w+)`", comment) if "Instead of" in comment else []
        found.append(Alternative(first, number, tuple(replaced)))
    return found


def taken(alternative: Alternative) -> str:
    """The reference with one alternative taken: its marks removed, and what it replaces removed."""
    text = lines()
    indent = MARK.match(text[alternative.first])[1]  # type: ignore[index]  # an alternative begins with a mark
    inserted = [
        f"{indent}{match[2]}" for line in text[alternative.first : alternative.last] if (match := MARK.match(line))
    ]
    above = text[: alternative.first]
    for key in alternative.replaces:
        begin = max(number for number, line in enumerate(above) if line.startswith(f"{indent}{key}:"))
        end = begin + 1
        while end < len(above) and (not above[end].strip() or above[end].startswith(f"{indent} ")):
            end += 1
        above = above[:begin] + above[end:]
    return "\n".join([*above, *inserted, *text[alternative.last :]]) + "\n"


def variants() -> list[str]:
    """The reference as it stands, and with each alternative in turn."""
    return ["\n".join(lines()) + "\n", *(taken(alternative) for alternative in alternatives())]


# ---------------------------------------------------------------- what is shown, against the schema


@cache
def config_schema() -> dict[str, Any]:
    """The JSON schema of a config."""
    return RunConfig.model_json_schema()


def config_keys() -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Block, key and schema of every key that a config may hold."""
    schema = config_schema()
    for block, body in {"": schema, **schema.get("$defs", {})}.items():
        for key, value in body.get("properties", {}).items():
            yield block, key, value


def resolved(schema: dict[str, Any], data: Any) -> tuple[str, dict[str, Any]] | None:
    """Name and body of the block that data of the reference are an example of; None where they are no block."""
    blocks = config_schema()["$defs"]
    ways = [schema, *schema.get("anyOf", []), *schema.get("oneOf", []), *schema.get("allOf", [])]
    if isinstance(schema.get("items"), dict):
        return resolved(schema["items"], data)
    for way in ways:
        if "$ref" in way:
            name = way["$ref"].removeprefix("#/$defs/")
            kind = blocks[name]["properties"].get("kind", {}).get("const")
            if isinstance(data, dict) and kind in (None, data.get("kind")) and {*data} <= {*blocks[name]["properties"]}:
                return name, blocks[name]
        elif way is not schema and (found := resolved(way, data)):
            return found
    return None


def examples(name: str, body: dict[str, Any], data: dict[str, Any]) -> Iterator[tuple[str, str, Any]]:
    """Block, key and value of everything that a config says, every item of a list by itself."""
    for key, value in data.items():
        yield name, key, value
        for item in value if isinstance(value, list) else [value]:
            schema = body.get("properties", {}).get(key, {})
            if found := resolved(schema, item):
                yield from examples(*found, item)
            of_any_key = schema.get("additionalProperties")
            for one in item.values() if isinstance(item, dict) and isinstance(of_any_key, dict) else ():
                if found := resolved(of_any_key, one):
                    yield from examples(*found, one)


def holds_blocks(values: list[Any]) -> bool:
    """Whether a key holds blocks, which are shown key by key, rather than a value."""
    first = [value[0] if isinstance(value, list) and value else value for value in values]
    return any(isinstance(value, dict) and value for value in first)


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], list[Any]]:
    """Every value that the reference shows, over all its variants, by block and key."""
    values: dict[tuple[str, str], list[Any]] = {}
    path = tmp_path_factory.mktemp("reference") / "part.yaml"
    for text in variants():
        path.write_text(text, encoding="utf-8")
        for block, key, value in examples("", config_schema(), read_yaml(path).data):
            values.setdefault((block, key), []).append(value)
    return values


def test_the_reference_shows_every_key_and_no_other(shown: dict[tuple[str, str], list[Any]]) -> None:
    known = {(block, key) for block, key, _ in config_keys()}
    assert known - set(shown) == set()
    assert set(shown) - known == set()


def test_the_reference_shows_every_default(shown: dict[tuple[str, str], list[Any]]) -> None:
    assert [
        f"{block}.{key}: {shown[block, key]}, by default {schema['default']}"
        for block, key, schema in config_keys()
        if "default" in schema and not holds_blocks(shown[block, key]) and schema["default"] not in shown[block, key]
    ] == []


@pytest.mark.parametrize("number", range(len(variants())))
def test_the_reference_is_a_config_with_each_alternative_taken(number: int, tmp_path: Path) -> None:
    path = tmp_path / "variant.yaml"
    path.write_text(variants()[number], encoding="utf-8")
    assert load(path).seed == 1


def test_the_reference_as_it_stands_passes_the_check(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert status(["check", str(REFERENCE), "--runs", str(tmp_path)]) == 0, capsys.readouterr().err
    assert not any(tmp_path.iterdir())


def test_every_config_key_says_what_it_is() -> None:
    referenced = ("$ref", "allOf")  # a block describes itself
    assert [
        f"{block}.{key}"
        for block, key, value in config_keys()
        if "description" not in value and not any(word in value for word in referenced)
    ] == []
