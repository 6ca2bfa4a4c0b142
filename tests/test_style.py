"""The house marks that ruff does not know: reasons for exceptions, no stubs, short functions and modules."""

from __future__ import annotations

import ast
import io
import re
import statistics
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

import pzd

PACKAGE = Path(pzd.__file__).parent
ROOT = Path(__file__).resolve().parent.parent
MODULES = sorted(PACKAGE.rglob("*.py"))
SOURCES = [*MODULES, *sorted((ROOT / "tests").rglob("*.py"))]

EXCEPTION = re.compile(r"#\s*(type:\s*ignore|noqa)\b")
EXCEPTION_WITH_REASON = re.compile(
    r"#\s*(type: ignore\[[a-z-]+(, ?[a-z-]+)*\]|noqa: [A-Z]+\d+(, ?[A-Z]+\d+)*)\s+# \S+ \S+"
)

MEDIAN_FUNCTION = 7
LONG_FUNCTION = 42
MEDIAN_MODULE = 100


def comments(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of every comment."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def without_reason(source: str) -> list[int]:
    """Lines that except themselves from a rule without naming it and saying why."""
    return [
        line for line, text in comments(source) if EXCEPTION.search(text) and not EXCEPTION_WITH_REASON.search(text)
    ]


def test_every_exception_from_a_rule_names_it_and_says_why() -> None:
    found = {str(path.relative_to(ROOT)): without_reason(path.read_text(encoding="utf-8")) for path in SOURCES}
    assert {path: lines for path, lines in found.items() if lines} == {}


@pytest.mark.parametrize(
    "mark", ["type: ignore", "noqa", "type: ignore[arg-type]", "noqa: S101", "noqa:S101 # a reason"]
)
def test_an_exception_without_rule_or_reason_is_found(mark: str) -> None:
    assert without_reason(f"x = 1  # {mark}\n") == [1]


@pytest.mark.parametrize(
    "mark", ["type: ignore[arg-type]  # numba is untyped", "noqa: S101, E501  # numbers of the paper"]
)
def test_an_exception_with_rule_and_reason_is_none(mark: str) -> None:
    assert without_reason(f"x = 1  # {mark}\n") == []


def test_every_exception_in_the_project_file_says_why() -> None:
    lines = (ROOT / "pyproject.toml").read_text(encoding="utf-8").splitlines()
    rules = [line for line in lines if re.match(r'\s+"[A-Z]+\d*",', line) or "ignore_" in line]
    assert [line for line in rules if not re.search(r"# \S+ \S+", line)] == []


def test_nothing_is_left_unfinished() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in MODULES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Name) and node.id == NotImplementedError.__name__
    ]
    assert found == []


def written_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function; its docstring does not make it long."""
    first = node.body[0]
    docstring = (first.end_lineno or first.lineno) - first.lineno + 1 if ast.get_docstring(node) else 0
    return (node.end_lineno or node.lineno) - node.lineno + 1 - docstring


def lengths() -> dict[str, int]:
    """Lines of every function."""
    return {
        f"{path.relative_to(PACKAGE)}:{node.lineno} {node.name}": written_lines(node)
        for path in MODULES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }


def test_functions_are_short() -> None:
    found = lengths()
    longest = sorted(found, key=lambda name: -found[name])[:10]
    assert statistics.median(found.values()) <= MEDIAN_FUNCTION
    assert statistics.quantiles(found.values(), n=20)[-1] <= LONG_FUNCTION, {name: found[name] for name in longest}


def test_modules_are_short() -> None:
    assert statistics.median(len(path.read_text(encoding="utf-8").splitlines()) for path in MODULES) <= MEDIAN_MODULE
