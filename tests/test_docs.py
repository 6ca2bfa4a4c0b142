"""The documentation says what the code does: commands, effects, files, paths, links and docstrings.

`test_reference_config.py` tests the config in full, `test_readme.py` runs the commands of the README.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
import typer
from parsed import tree
from typer.core import TyperGroup, TyperOption

import pzd
from pzd import artefacts
from pzd.cli import output
from pzd.cli.app import app
from pzd.cli.interrupt import INTERRUPTED
from pzd.damper.effects import library
from pzd.schema.errors import ConfigError, DataError, FilesError

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = Path(pzd.__file__).parent

Function = ast.FunctionDef | ast.AsyncFunctionDef


def page(name: str) -> str:
    """The text of a page of the documentation."""
    return (ROOT / name).read_text(encoding="utf-8")


def code_of(text: str) -> str:
    """What a page sets as code: fenced blocks and what stands between backticks."""
    blocks = re.findall(r"^ *```.*?^ *```", text, re.MULTILINE | re.DOTALL)
    rest = re.sub(r"^ *```.*?^ *```", "", text, flags=re.MULTILINE | re.DOTALL)
    return "\n".join([*blocks, *re.findall(r"`[^`\n]+`", rest)])


def pages() -> list[str]:
    """Every page of the documentation, from the root; `runs/` holds results below its own page."""
    folders = [ROOT, ROOT / "configs", ROOT / "runs", ROOT / "docs"]
    found = [path for folder in folders for path in folder.glob("*.md")] + [*PACKAGE.rglob("*.md")]
    return sorted(path.relative_to(ROOT).as_posix() for path in found)


every_page = pytest.mark.parametrize("name", pages())


def names(word: str, text: str) -> bool:
    """Whether a text holds the word as a whole."""
    return re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", text) is not None


# ---------------------------------------------------------------- the pages


def commands() -> Mapping[str, Any]:
    """Every command of the command line by name."""
    group = typer.main.get_command(app)
    assert isinstance(group, TyperGroup)
    return group.commands


def test_the_readme_leads_to_every_other_page() -> None:
    missing = [name for name in pages() if name != "README.md" and f"]({name})" not in page("README.md")]
    assert missing == []


COMMANDS = "docs/commands.md"


def test_every_command_is_in_the_page_of_the_commands() -> None:
    code = code_of(page(COMMANDS))
    assert [name for name in commands() if not names(f"pzd {name}", code)] == []


@every_page
def test_every_command_of_a_page_exists(name: str) -> None:
    assert set(re.findall(r"\bpzd ([a-z]+)\b", code_of(page(name)))) - set(commands()) == set()


def test_every_option_is_in_the_page_of_the_commands() -> None:
    code = code_of(page(COMMANDS))
    options = {long for command in commands().values() for option in command.params for long in option.opts[:1]}
    assert [option for option in sorted(options) if option.startswith("-") and not names(option, code)] == []


@pytest.mark.parametrize("name", ["README.md", COMMANDS])
def test_every_option_of_a_page_exists(name: str) -> None:
    group = typer.main.get_command(app)
    known = {name for command in (group, *commands().values()) for option in command.params for name in option.opts}
    assert set(re.findall(r"(?<![\w-])--[a-z-]+", code_of(page(name)))) - known == set()


def test_every_exit_code_is_in_the_page_of_the_commands() -> None:
    codes = {output.DONE, output.OWN_FAULT, output.UNTRUSTED, INTERRUPTED}
    codes |= {error.exit_code for error in (ConfigError, DataError, FilesError)}
    assert codes == {int(code) for code in re.findall(r"^\| (\d+) \|", page(COMMANDS), re.MULTILINE)}


def test_every_command_and_option_has_its_help() -> None:
    silent = [name for name, command in commands().items() if not command.help]
    silent += [
        f"{name} {option.opts[0]}"
        for name, command in commands().items()
        for option in command.params
        if isinstance(option, TyperOption) and not option.help
    ]
    assert silent == []


def test_the_readme_names_every_effect_and_how_many_there_are() -> None:
    table = page("README.md").partition("## The twenty-three effects")[2].partition("## ")[0]
    assert set(re.findall(r"`([a-z]+_?[a-z_]*)`", table)) == set(library())
    assert len(library()) == 23


def test_the_readme_is_three_pages() -> None:
    assert len(page("README.md").splitlines()) <= 250


def test_every_effect_stands_in_the_page_of_the_code_with_its_place_and_parameters() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (\w+) \| .* \| (.*) \|$", page("pzd/README.md"), re.MULTILINE)
    shown = {name: (place, re.findall(r"\w+(?=,| \[)", symbols)) for name, place, symbols in rows}
    assert {
        name: (effect.place, [parameter.name for parameter in effect.parameters]) for name, effect in library().items()
    } == shown


def test_every_folder_of_the_package_is_in_the_page_of_the_code() -> None:
    text = page("pzd/README.md")
    rooms = [path for path in PACKAGE.iterdir() if path.is_dir() and (path / "__init__.py").is_file()]
    assert rooms
    assert [room.name for room in sorted(rooms) if f"| `pzd/{room.name}/` |" not in text] == []


def test_every_file_that_a_stage_writes_is_in_the_page_of_the_results() -> None:
    code = code_of(page("runs/README.md"))
    sources = PACKAGE.rglob("artefacts*/*.py") if hasattr(artefacts, "__path__") else [PACKAGE / "artefacts.py"]
    texts = [path.read_text(encoding="utf-8") for path in sources]
    files = {name for text in texts for name in re.findall(r'"([a-z]+\.(?:csv|json|yaml|html))"', text)}
    assert files
    assert [name for name in sorted(files) if not names(name, code)] == []


def test_every_config_is_in_the_page_of_the_configs() -> None:
    text = page("configs/README.md")
    assert [path.name for path in (ROOT / "configs").glob("*.yaml") if f"]({path.name})" not in text] == []


@every_page
def test_every_make_target_of_a_page_exists(name: str) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"\bmake ([a-z-]+)\b", code_of(page(name)))) - targets == set()


@every_page
def test_every_path_that_a_page_names_exists(name: str) -> None:
    known = (
        r"(?<![\w./-])(?:pzd|tests|configs|\.ci|\.github)/[\w./*-]*|(?<![\w./-])(?:README\.md|Makefile|pyproject\.toml)"
    )
    named = {path.rstrip(".") for path in re.findall(known, code_of(page(name)))}
    assert [path for path in sorted(named) if not any(ROOT.glob(path.rstrip("/")))] == []


def test_every_folder_inside_a_package_that_the_page_of_the_code_names_exists() -> None:
    rows = re.findall(r"^\| `pzd/(\w+)/` \| (.*) \|$", page("pzd/README.md"), re.MULTILINE)
    inside = [(room, folder) for room, text in rows for folder in re.findall(r"`(\w+)/`", text)]
    assert inside
    assert [f"pzd/{room}/{folder}" for room, folder in inside if not (PACKAGE / room / folder).is_dir()] == []


def test_what_a_new_file_of_a_set_must_define_is_defined_by_the_one_to_copy() -> None:
    rows = re.findall(r"^\| an? [\w ]+ \| `(pzd/[\w/]+\.py)` \| (.*) \|$", page("pzd/README.md"), re.MULTILINE)
    assert rows
    assert [
        f"{name}: {symbol}"
        for name, text in rows
        for symbol in re.findall(r"`([\w(), ]+)`", text)
        if symbol.partition("(")[0] not in page(name)
    ] == []


@every_page
def test_links_to_files_lead_somewhere(name: str) -> None:
    folder = (ROOT / name).parent
    targets = re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page(name))
    assert [target for target in targets if "://" not in target and not (folder / target).exists()] == []


def headings(text: str) -> set[str]:
    """The anchors of the headings of a page, as GitHub makes them."""
    found = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", "-") for heading in found}


@every_page
def test_headings_that_a_page_links_to_exist(name: str) -> None:
    folder = (ROOT / name).parent
    links = re.findall(r"\]\(([^)#\s]*\.md)?#([^)]+)\)", page(name))
    texts = {target: (folder / target).read_text(encoding="utf-8") if target else page(name) for target, _ in links}
    assert [f"{target}#{anchor}" for target, anchor in links if anchor not in headings(texts[target])] == []


def told_of_studies() -> dict[str, str]:
    """What tells how the studies are run: their docstrings and the Makefile, by path."""
    studies = sorted((ROOT / "tests" / "studies").glob("*.py"))
    told = {path.relative_to(ROOT).as_posix(): ast.get_docstring(tree(path)) or "" for path in studies}
    return {**told, "Makefile": page("Makefile")}


def missing_of_tests(text: str) -> list[str]:
    """The paths below `tests/` that a text names and that do not exist."""
    named = {path.rstrip("./") for path in re.findall(r"(?<![\w./-])tests/[\w./-]*", text)}
    return [path for path in sorted(named) if not (ROOT / path).exists()]


def test_every_path_of_the_tests_that_a_study_or_the_makefile_names_exists() -> None:
    told = told_of_studies()
    assert any("python tests/studies/" in text for text in told.values())
    assert {name: missing for name, text in told.items() if (missing := missing_of_tests(text))} == {}
    line = "PYTHONPATH=.:tests/identify python tests/studies/none.py, see tests/fit/"
    assert missing_of_tests(line) == ["tests/identify", "tests/studies/none.py"]


# ---------------------------------------------------------------- the docstrings


def public() -> Iterator[tuple[str, Function | ast.ClassDef, ast.ClassDef | None]]:
    """Place, node and class of every public function, method and class."""
    for path in sorted(PACKAGE.rglob("*.py")):
        module = tree(path)
        scopes: list[tuple[ast.Module | ast.ClassDef, ast.ClassDef | None]] = [(module, None)]
        scopes += [(node, node) for node in module.body if isinstance(node, ast.ClassDef)]
        for scope, owner in scopes:
            for node in scope.body:
                if isinstance(node, Function | ast.ClassDef) and not node.name.startswith("_"):
                    yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", node, owner


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
