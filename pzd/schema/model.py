"""The base of every validated model: frozen, strict, without unknown keys or infinities."""

from __future__ import annotations

import ast
import copy
import difflib
import inspect
import re
import textwrap
import types
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field

from pzd.quantities import VOLTAGE

# ----------------------------------------------------------------------------------------------------
# The docstrings under the fields of models, in the JSON schema that editors read.
#
# Pydantic could read them, of every model that is imported: a fifth of the time of a command that finds nothing to do.


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


# ----------------------------------------------------------------------------------------------------
# The names of records and files.


def safe_name(text: str) -> str:
    """A text as a name that every file system takes: all but letters, digits, `.`, `_` and `-` becomes `_`."""
    return re.sub(r"[^A-Za-z0-9._-]", "_", text)


# ----------------------------------------------------------------------------------------------------


def for_editors(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Describe each key, and let keys of the control signal be called after any one, which no editor knows.

    Parameters
    ----------
    schema : JSON schema of a block; beside `voltage_V` stands a pattern that `current_A` and `rebound_clicks` meet, and
        no other key of the block
    model : the block
    """
    describe_keys(schema, model)
    properties: dict[str, Any] = schema.get("properties", {})
    others = "|".join(map(re.escape, properties))
    for name, body in properties.items():
        before, named, after = name.partition(VOLTAGE.name)
        if named:
            unit = f"_{VOLTAGE.unit}"
            after = after.removesuffix(unit) + (r"_\w+" if after.endswith(unit) else "")
            pattern = rf"^(?!(?:{others})$){before}[A-Za-z]\w*{after}$"
            schema.setdefault("patternProperties", {})[pattern] = copy.deepcopy(body)


class Frozen(BaseModel):
    """A block of the config or of an artefact; the docstring under a field documents it."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        json_schema_extra=for_editors,
    )

    former_keys: ClassVar[Mapping[str, str]] = {}
    """Keys that a config had once, each with the one that stands in its place: a hint where the old one is written."""


class OneOfAKind(Frozen):
    """A block of which there are several kinds, one file each, and which names what is made of it."""

    kind: str
    """Which kind."""
    label: str | None = Field(default=None, pattern=r"^[A-Za-z0-9._-]+$")
    """Name in the names of records and cases; by default made from kind and size."""

    @property
    def name(self) -> str:
        """How records and cases call it."""
        return self.label or self.own_name()

    @abstractmethod
    def own_name(self) -> str:
        """The name made from kind and size."""


# ----------------------------------------------------------------------------------------------------
# Which keys a model takes at a place, and which of them a wrong key most likely meant.


KeyPath = tuple[str | int, ...]


def nearest(given: str, valid: Iterable[str]) -> str | None:
    """The valid name most like the given one, None where none is like it."""
    lower = {name.lower(): name for name in valid}
    found = difflib.get_close_matches(given.lower(), lower, 1, 0.6)
    return lower[found[0]] if found else None


def keys_at(annotation: Any, path: KeyPath, data: Any) -> list[str]:
    """The keys that the model of this annotation takes in the mapping at a path of the data."""
    return list(dict.fromkeys(key for one in _models_at(annotation, path, data) for key in one.model_fields))


def former_keys(annotation: Any, path: KeyPath, data: Any) -> dict[str, str]:
    """The keys that the model at a path of the data took once, each with the one that stands in its place."""
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
    """The members of a union, without models whose discriminator the data contradict, unless that is all of them."""
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
    """The annotation of one field or item; None where there is none."""
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
