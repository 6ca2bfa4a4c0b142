"""Syntax trees of the package, parsed once for all tests that read code."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path


@cache
def tree(path: Path) -> ast.Module:
    """The syntax tree of a module; not to be changed."""
    return ast.parse(path.read_text(encoding="utf-8"), str(path))
