"""Which keys a model takes at a place, and which of them a wrong key most likely meant."""

from __future__ import annotations

import difflib
import types
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pzd.schema.model import Frozen

Path = tuple[str | int, ...]


def nearest(given: str, valid: Iterable[str]) -> str | None:
    """The valid name most like the given one, None where none is like it."""
    lower = {name.lower(): name for name in valid}
    found = difflib.get_close_matches(given.lower(), lower, 1, 0.6)
    return lower[found[0]] if found else None


def keys_at(annotation: Any, path: Path, data: Any) -> list[str]:
    """The keys that the model of this annotation takes in the mapping at a path of the data."""
    return list(dict.fromkeys(key for one in _models_at(annotation, path, data) for key in one.model_fields))


def former_keys(annotation: Any, path: Path, data: Any) -> dict[str, str]:
    """The keys that the model at a path of the data took once, each with the one that stands in its place."""
    return {old: new for one in _models_at(annotation, path, data) for old, new in one.former_keys.items()}


def _models_at(annotation: Any, path: Path, data: Any) -> list[type[Frozen]]:
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
