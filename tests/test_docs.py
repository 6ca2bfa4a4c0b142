"""The documentation says what the code does: commands, config keys, effects, files, docstrings and links."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.core import TyperGroup, TyperOption

import pzd
from pzd import artefacts
from pzd.cli.app import app
from pzd.config import RunConfig
from pzd.damper.effects import library
from pzd.schema.yamlfile import read_yaml

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = Path(pzd.__file__).parent
DOCUMENTED = 0.92
"""Share of the public functions and classes that have a docstring, at least."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


@pytest.fixture(scope="module")
def readme() -> str:
    """The README."""
    return (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def code(readme: str) -> str:
    """What the README sets as code: fenced blocks and what stands between backticks."""
    blocks = re.findall(r"^```.*?^```", readme, re.MULTILINE | re.DOTALL)
    rest = re.sub(r"^```.*?^```", "", readme, flags=re.MULTILINE | re.DOTALL)
    return "\n".join([*blocks, *re.findall(r"`[^`\n]+`", rest)])


def names(word: str, text: str) -> bool:
    """Whether a text holds the word as a whole."""
    return re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", text) is not None


# ---------------------------------------------------------------- the README


def commands() -> Mapping[str, Any]:
    """Every command of the command line by name."""
    group = typer.main.get_command(app)
    assert isinstance(group, TyperGroup)
    return group.commands


def test_every_command_is_in_the_readme(code: str) -> None:
    assert [name for name in commands() if not names(f"pzd {name}", code)] == []


def test_every_command_of_the_readme_exists(code: str) -> None:
    assert set(re.findall(r"\bpzd ([a-z]+)\b", code)) - set(commands()) == set()


def test_every_option_is_in_the_readme(code: str) -> None:
    options = {long for command in commands().values() for option in command.params for long in option.opts[:1]}
    assert [option for option in sorted(options) if option.startswith("-") and not names(option, code)] == []


def test_every_command_and_option_has_its_help() -> None:
    silent = [name for name, command in commands().items() if not command.help]
    silent += [
        f"{name} {option.opts[0]}"
        for name, command in commands().items()
        for option in command.params
        if isinstance(option, TyperOption) and not option.help
    ]
    assert silent == []


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


def test_every_config_key_is_in_the_readme(code: str) -> None:
    assert sorted({f"{block}.{key}" for block, key, _ in config_keys() if not names(key, code)}) == []


def resolved(schema: dict[str, Any], data: Any) -> tuple[str, dict[str, Any]] | None:
    """Name and body of the block that data of the README are an example of; None where they are no block."""
    blocks = config_schema()["$defs"]
    ways = [schema, *schema.get("anyOf", []), *schema.get("oneOf", []), *schema.get("allOf", [])]
    if isinstance(schema.get("items"), dict):
        return resolved(schema["items"], data)
    for way in ways:
        if "$ref" in way:
            name = way["$ref"].removeprefix("#/$defs/")
            kind = blocks[name]["properties"].get("kind", {}).get("const")
            if isinstance(data, dict) and kind in (None, data.get("kind")):
                return name, blocks[name]
        elif way is not schema and (found := resolved(way, data)):
            return found
    return None


def examples(name: str, body: dict[str, Any], data: dict[str, Any]) -> Iterator[tuple[str, str, Any]]:
    """Block, key and value of everything that the README's config says, every item of a list by itself."""
    for key, value in data.items():
        yield name, key, value
        for item in value if isinstance(value, list) else [value]:
            found = resolved(body.get("properties", {}).get(key, {}), item)
            if found:
                yield from examples(*found, item)


def holds_blocks(values: list[Any]) -> bool:
    """Whether a key holds blocks, which are shown key by key, rather than a value."""
    first = [value[0] if isinstance(value, list) and value else value for value in values]
    return any(isinstance(value, dict) and value for value in first)


def test_the_config_reference_shows_every_key_with_its_default(readme: str, tmp_path: Path) -> None:
    texts = re.findall(r"<!-- config reference -->\n```yaml\n(.*?)^```", readme, re.MULTILINE | re.DOTALL)
    shown: dict[tuple[str, str], list[Any]] = {}
    for text in texts:
        (tmp_path / "part.yaml").write_text(text, encoding="utf-8")
        data = read_yaml(tmp_path / "part.yaml").data
        for block, key, value in examples("", config_schema(), data):
            shown.setdefault((block, key), []).append(value)
    known = {(block, key): value for block, key, value in config_keys()}
    assert set(known) - set(shown) == set()
    assert set(shown) - set(known) == set()
    assert [
        f"{'.'.join(place)}: {shown[place]}, by default {schema['default']}"
        for place, schema in known.items()
        if "default" in schema and not holds_blocks(shown[place]) and schema["default"] not in shown[place]
    ] == []


def test_every_config_key_says_what_it_is() -> None:
    referenced = ("$ref", "allOf")  # a block describes itself
    assert [
        f"{block}.{key}"
        for block, key, value in config_keys()
        if "description" not in value and not any(word in value for word in referenced)
    ] == []


def test_every_effect_is_in_the_readme(code: str) -> None:
    assert [name for name in library() if not names(name, code)] == []


def test_every_file_that_a_stage_writes_is_in_the_readme(code: str) -> None:
    sources = PACKAGE.rglob("artefacts*/*.py") if hasattr(artefacts, "__path__") else [PACKAGE / "artefacts.py"]
    texts = [path.read_text(encoding="utf-8") for path in sources]
    files = {name for text in texts for name in re.findall(r'"([a-z]+\.(?:csv|json|yaml|html))"', text)}
    assert files
    assert [name for name in sorted(files) if not names(name, code)] == []


def test_every_make_target_of_the_readme_exists(code: str) -> None:
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"\bmake ([a-z]+)\b", code)) - targets == set()


def test_links_to_files_lead_somewhere() -> None:
    pages = [*ROOT.glob("*.md"), *(ROOT / "runs").glob("*.md")]
    dead = [
        f"{page.relative_to(ROOT)}: {target}"
        for page in pages
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
        if "://" not in target and not (page.parent / target).exists()
    ]
    assert dead == []


def test_headings_that_the_readme_links_to_exist(readme: str) -> None:
    headings = {
        re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", "-")
        for heading in re.findall(r"^#+ (.+)$", readme, re.MULTILINE)
    }
    assert set(re.findall(r"\]\(#([^)]+)\)", readme)) - headings == set()


# ---------------------------------------------------------------- the docstrings


def public() -> Iterator[tuple[str, Function | ast.ClassDef, ast.ClassDef | None]]:
    """Place, node and class of every public function, method and class."""
    for path in sorted(PACKAGE.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        scopes: list[tuple[ast.Module | ast.ClassDef, ast.ClassDef | None]] = [(tree, None)]
        scopes += [(node, node) for node in tree.body if isinstance(node, ast.ClassDef)]
        for scope, owner in scopes:
            for node in scope.body:
                if isinstance(node, Function | ast.ClassDef) and not node.name.startswith("_"):
                    yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", node, owner


def test_public_functions_and_classes_have_docstrings() -> None:
    found = {place: ast.get_docstring(node) for place, node, _ in public()}
    silent = [place for place, docstring in found.items() if not docstring]
    assert len(silent) <= (1.0 - DOCUMENTED) * len(found), silent


def documented_parameters(docstring: str) -> list[str] | None:
    """The names of the section Parameters in their order; None where there is no such section."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=\n\n|\n\w[^\n]*\n-+\n|\Z)", docstring, re.MULTILINE | re.DOTALL)
    if section is None:
        return None
    heads = re.findall(r"^([*\w]+(?:, ?[*\w]+)*) :", section[1], re.MULTILINE)
    return [name.strip().lstrip("*") for head in heads for name in head.split(",")]


def parameters(node: Function | ast.ClassDef, owner: ast.ClassDef | None) -> list[str]:
    """The names that a function takes, or the fields of a class."""
    if isinstance(node, ast.ClassDef):
        return [n.target.id for n in node.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)]
    arguments = node.args
    every = [*arguments.posonlyargs, *arguments.args, arguments.vararg, *arguments.kwonlyargs, arguments.kwarg]
    taken = [argument.arg for argument in every if argument]
    return [name for name in taken if not (owner and name in {"self", "cls"})]


def test_documented_parameters_are_those_of_the_signature() -> None:
    wrong = {}
    for place, node, owner in public():
        documented = documented_parameters(ast.get_docstring(node) or "")
        if documented is not None and documented != parameters(node, owner):
            wrong[place] = f"documented {documented}, taken {parameters(node, owner)}"
    assert wrong == {}


def test_a_section_of_parameters_is_read_as_written() -> None:
    text = "Force.\n\nParameters\n----------\na, b : both [m]\nc : one\n    of two lines\n\nReturns\n-------\nd : force"
    assert documented_parameters(text) == ["a", "b", "c"]
    assert documented_parameters("Force.") is None
