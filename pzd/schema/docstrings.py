"""The docstrings under the fields of models, in the JSON schema that editors read.

Pydantic could read them, of every model that is imported: a fifth of the time of a command that finds nothing to do.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from itertools import pairwise
from typing import Any

from pydantic import BaseModel


def describe_keys(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Describe each key by the docstring under its field.

    Parameters
    ----------
    schema : JSON schema of a block, changed in place
    model : the block
    """
    properties: dict[str, Any] = schema.get("properties", {})
    for name, text in _field_docstrings(model).items():
        if name in properties:
            properties[name]["description"] = text


def _field_docstrings(model: type[BaseModel]) -> dict[str, str]:
    """The docstring under each field of a model; of an inherited one that of its own class."""
    found: dict[str, str] = {}
    for cls in reversed(model.__mro__):
        if not issubclass(cls, BaseModel) or cls is BaseModel:
            continue
        definition = ast.parse(textwrap.dedent(inspect.getsource(cls))).body[0]
        body = definition.body if isinstance(definition, ast.ClassDef) else []
        for field, following in pairwise([*body, ast.Pass()]):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
                found.pop(field.target.id, None)
                if isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant):
                    found[field.target.id] = inspect.cleandoc(str(following.value.value))
    return found
