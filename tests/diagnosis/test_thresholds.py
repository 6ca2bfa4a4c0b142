"""The table of thresholds is whole: each says why it has its value, is in use, and none hides in the search."""

from __future__ import annotations

import ast
from pathlib import Path

import pzd.diagnosis
from pzd.diagnosis import thresholds

PACKAGE = Path(pzd.diagnosis.__file__).parent
TABLE = Path(thresholds.__file__)


def constants(path: Path) -> dict[str, str]:
    """Name -> the string below it, of every constant of a module that is written in numbers."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    found = {}
    for statement, following in zip(body, [*body[1:], ast.Pass()], strict=True):
        if isinstance(statement, ast.Assign) and any(
            isinstance(node, ast.Constant) and isinstance(node.value, int | float) for node in ast.walk(statement.value)
        ):
            text = (
                following.value.value
                if isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
                else ""
            )
            found[ast.unparse(statement.targets[0])] = str(text)
    return found


def test_every_threshold_says_what_it_decides_and_why_it_has_its_value() -> None:
    table = constants(TABLE)
    assert len(table) > 20
    assert [
        name for name, text in table.items() if not (text.split("\n\nReason: ")[0] and "\n\nReason: " in text)
    ] == []


def test_every_threshold_is_in_use() -> None:
    used = {
        node.attr
        for path in PACKAGE.rglob("*.py")
        if path != TABLE
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "thresholds"
    }
    assert sorted(constants(TABLE).keys() - used) == []


def test_the_search_has_no_threshold_beside_the_table() -> None:
    modules = sorted((PACKAGE / "search").glob("*.py"))
    assert {path.name: found for path in modules if (found := constants(path))} == {}
