"""JSON artefacts: a validated model or a list of them, read back strictly with file and line."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from pzd.quantities import Control
from pzd.schema.control import canonical, canonical_nodes, misnamed, renamed_keys
from pzd.schema.errors import DataError, at
from pzd.schema.model import Frozen
from pzd.schema.nodes import compose
from pzd.schema.text import read_text
from pzd.schema.validate import validated

Model = TypeVar("Model", bound=Frozen)


def write_json(path: Path, content: Frozen | Sequence[Frozen] | Mapping[str, Any], control: Control) -> None:
    """Write a model, a list of models or plain data, keys of the control under its own name."""
    path.write_text(json_text(plain_data(content, control)) + "\n", encoding="utf-8", newline="\n")


def json_text(data: Any) -> str:
    """Plain data as JSON, indented, without a line break at its end."""
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False)


def plain_data(content: Any, control: Control) -> Any:
    """Models, and lists and mappings of them, as plain data with keys of the control under its own name."""
    return renamed_keys(_built_in_types(content), control)


def read_json(path: Path, model: type[Model], control: Control) -> Model:
    """Read what `write_json` wrote (or a person edited).

    Raises
    ------
    DataError : when the file is not what the model asks for, with every place
    """
    found: Model = _read(path, model, control)
    return found


def read_json_list(path: Path, model: type[Model], control: Control) -> tuple[Model, ...]:
    """Read a list of models.

    Raises
    ------
    DataError : when the file is not a list of what the model asks for, with every place
    """
    found: tuple[Model, ...] = _read(path, tuple[model, ...], control)  # type: ignore[valid-type]  # made at run time
    return found


def _built_in_types(content: Any) -> Any:
    if isinstance(content, Frozen):
        return content.model_dump(mode="json")
    if isinstance(content, Mapping):
        return {key: _built_in_types(value) for key, value in content.items()}
    return [_built_in_types(value) for value in content] if isinstance(content, list | tuple) else content


def _read(path: Path, annotation: Any, control: Control) -> Any:
    text = read_text(path, DataError, "run the stage again")
    try:
        data = json.loads(text, object_pairs_hook=lambda pairs: _canonical_object(pairs, control))
        return TypeAdapter(annotation).validate_json(json.dumps(data))
    except json.JSONDecodeError as fault:
        raise DataError(f"{at(path, fault.lineno, fault.colno)}: not JSON: {fault.msg}") from None
    except (ValidationError, _MisnamedError, ValueError, RecursionError):
        return _read_with_places(path, text, annotation, control)


class _MisnamedError(Exception):
    """A key that stands twice or under the wrong name of the control."""


def _canonical_object(pairs: list[tuple[str, Any]], control: Control) -> dict[str, Any]:
    made = {canonical(key, control): value for key, value in pairs}
    if len(made) < len(pairs) or any(control.renamed(key) != key for key, _ in pairs):
        raise _MisnamedError
    return made


def _read_with_places(path: Path, text: str, annotation: Any, control: Control) -> Any:
    """Read the text once more as YAML, of which JSON is a part, to know the places of the faults."""
    root = compose(text.replace("\t", " "), path, DataError)
    if faults := misnamed(root, control):
        raise DataError(faults)
    return validated(annotation, canonical_nodes(root, control), control, DataError)
