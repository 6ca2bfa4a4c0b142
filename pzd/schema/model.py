"""Base of every validated model: frozen, strict, without unknown keys or infinities; and lookup of its keys."""

from __future__ import annotations

import ast
import copy
import difflib
import inspect
import itertools
import re
import textwrap
import types
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field

from pzd.quantities import VOLTAGE


def for_editors(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Describe each key, and let those of the control signal bear any control's name: `current_A`, `rebound_clicks`.

    Parameters
    ----------
    schema : JSON schema of a block, changed in place; the pattern that is added fits no other key of the block
    model : the block
    """
    properties: dict[str, Any] = schema.get("properties", {})
    for name, body in properties.items():
        declared_in = next(one for one in model.__mro__ if name in inspect.get_annotations(one))
        if text := _field_docstrings(declared_in).get(name):
            body.setdefault("description", text)
    others = "|".join(map(re.escape, properties))
    for name, body in properties.items():
        before, named, after = name.partition(VOLTAGE.name)
        if named:
            unit = f"_{VOLTAGE.unit}"
            after = after.removesuffix(unit) + (r"_\w+" if after.endswith(unit) else "")
            pattern = rf"^(?!(?:{others})$){before}[A-Za-z]\w*{after}$"
            schema.setdefault("patternProperties", {})[pattern] = copy.deepcopy(body)


@cache
def _field_docstrings(block: type) -> dict[str, str]:
    """Return the docstring under each field of a block that has one.

    Pydantic would read the sources of all blocks whenever they are imported, which takes a third of that time.
    """
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(block))).body
    lines = body.body if isinstance(body, ast.ClassDef) else []
    return {
        field.target.id: inspect.cleandoc(below.value.value)
        for field, below in itertools.pairwise(lines)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant) and isinstance(below.value.value, str)
    }


class Frozen(BaseModel):
    """Block of the config or of an artefact; the docstring under a field describes its key in the JSON schema."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        json_schema_extra=for_editors,
    )

    former_keys: ClassVar[Mapping[str, str]] = {}
    """Keys of earlier versions, each with the one in its place: a hint where the old one is used."""


class OneOfAKind(Frozen):
    """Block of which there are several kinds, one file each, with a name for records and cases."""

    kind: str
    """Which kind."""
    label: str | None = Field(default=None, pattern=r"^[A-Za-z0-9._-]+$")
    """Name in the names of records and cases; by default made from kind and size."""

    @property
    def name(self) -> str:
        """Name in the names of records and cases."""
        return self.label or self.own_name()

    @abstractmethod
    def own_name(self) -> str:
        """Return the name made from kind and size."""


def safe_name(text: str) -> str:
    """Make a name for any file system: all but letters, digits, `.`, `_` and `-` becomes `_`.

    Examples
    --------
    >>> safe_name("gap 0.25 mm")
    'gap_0.25_mm'
    """
    return re.sub(r"[^A-Za-z0-9._-]", "_", text)


# --- Keys of a model at a place of the data, and the key that a wrong one most likely meant ---

KeyPath = tuple[str | int, ...]


def nearest(given: str, valid: Iterable[str]) -> str | None:
    """Return the valid name most like the given one, None where none is like it.

    Examples
    --------
    >>> nearest("forse", ["force", "voltage"])
    'force'
    """
    lower = {name.lower(): name for name in valid}
    found = difflib.get_close_matches(given.lower(), lower, 1, 0.6)
    return lower[found[0]] if found else None


def all_keys(block: type[Frozen] = Frozen) -> set[str]:
    """Return the keys of every block that is declared so far."""
    blocks = block.__subclasses__()
    return {key for one in blocks for key in one.model_fields} | {key for one in blocks for key in all_keys(one)}


def keys_at(annotation: Any, path: KeyPath, data: Any) -> list[str]:
    """Return the keys of the model in the mapping at a path of the data."""
    return list(dict.fromkeys(key for one in _models_at(annotation, path, data) for key in one.model_fields))


def former_keys(annotation: Any, path: KeyPath, data: Any) -> dict[str, str]:
    """Return the former keys of the model at a path of the data, each with the one in its place."""
    return {old: new for one in _models_at(annotation, path, data) for old, new in one.former_keys.items()}


def _models_at(annotation: Any, path: KeyPath, data: Any) -> list[type[Frozen]]:
    candidates = _alternatives(annotation, data)
    for part in path:
        data = _inside(data, part)
        candidates = [deeper for one in candidates for deeper in _alternatives(_under(one, part), data)]
    return [one for one in candidates if _is_model(one)]


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, Frozen)


def _alternatives(annotation: Any, data: Any) -> list[Any]:
    """Return the members of a union without models whose discriminator the data contradict, unless all do."""
    members = list(_members(annotation))
    return [one for one in members if not (_is_model(one) and _contradicts(one, data))] or members


def _members(annotation: Any) -> Iterator[Any]:
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from _members(get_args(annotation)[0])
    elif origin in (Union, types.UnionType):
        for member in get_args(annotation):
            yield from _members(member)
    else:
        yield annotation


def _contradicts(model: type[Frozen], data: Any) -> bool:
    if not isinstance(data, Mapping):
        return False
    return any(
        get_origin(info.annotation) is Literal and name in data and data[name] not in get_args(info.annotation)
        for name, info in model.model_fields.items()
    )


def _under(annotation: Any, part: str | int) -> Any:
    """Return the annotation of one field or item; None where there is none."""
    if _is_model(annotation):
        info = annotation.model_fields.get(part)
        return info.annotation if info else None
    arguments = [argument for argument in get_args(annotation) if argument is not Ellipsis]
    origin = get_origin(annotation)
    if not arguments or not isinstance(origin, type):
        return None
    return arguments[-1] if issubclass(origin, Mapping) or issubclass(origin, Sequence) else None


def _inside(data: Any, part: str | int) -> Any:
    try:
        return data[part]
    except (KeyError, IndexError, TypeError):
        return None
