"""Validation of a tree of nodes against a model, every fault at once with its place and what to do; JSON artefacts."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from pzd.quantities import VOLTAGE, Control
from pzd.schema.errors import DataError, InsideError, UserError, at, read_text, worded
from pzd.schema.model import Frozen, KeyPath, former_keys, keys_at, nearest
from pzd.schema.yamltree import Entry, Node, collection, compose

_LONGEST = 60
"""Characters of a wrong value that a message repeats."""


def validated(annotation: Any, root: Node, control: Control, error: type[UserError]) -> Any:
    """Validate a tree against a model.

    Parameters
    ----------
    annotation : the model, or a type made of models
    root : the tree, with canonical keys
    control : the control signal, for messages
    error : the kind of error to raise

    Returns
    -------
    the validated model

    Raises
    ------
    UserError : of the kind `error`, with every fault
    """
    data = root.data()
    try:
        return TypeAdapter(annotation).validate_json(json.dumps(data))
    except ValidationError as found:
        faults = _merged([_fault(detail, root) for detail in found.errors(include_url=False)])
        messages = [_message(group, annotation, root, data, control) for group in faults]
        raise error(sorted(messages, key=_position)) from None


def _position(message: str) -> list[int]:
    """Return line and column of a message, to sort by; none for what the command line set."""
    place = re.match(r".*?:(\d+):(\d+): ", message)
    return [int(number) for number in place.groups()] if place else []


@dataclass(frozen=True)
class _Fault:
    """A fault that pydantic found, at a path of the tree."""

    path: KeyPath
    node: Node
    """Deepest existing node of the path."""
    detail: Mapping[str, Any]
    in_union: bool
    """Whether it is that of one member of a union."""
    of_key: bool = False
    """Whether the last key of the path is wrong itself."""


def _fault(detail: Mapping[str, Any], root: Node) -> _Fault:
    """Follow the location of pydantic, which also names members of unions, through the tree."""
    path: list[str | int] = []
    node, skipped = root, False
    location = detail["loc"]
    for number, part in enumerate(location):
        below = _below(node, part)
        if below is not None:
            node = below
            path.append(part)
        elif number == len(location) - 1 and "missing" in detail["type"]:
            path.append(part)
        else:
            skipped = True
    inside, of_key = detail.get("ctx", {}).get("error"), False
    if isinstance(inside, InsideError):
        for part in inside.path:
            below = _below(node, part)
            if below is None:
                break
            node = below
            path.append(part)
        else:
            of_key = inside.of_key
    return _Fault(tuple(path), node, detail, skipped, of_key)


def _below(node: Node, part: str | int) -> Node | None:
    if isinstance(node.value, Mapping) and isinstance(part, str) and part in node.value:
        return node.value[part].node
    if isinstance(node.value, tuple) and isinstance(part, int) and part < len(node.value):
        return node.value[part]
    return None


def _merged(faults: list[_Fault]) -> list[list[_Fault]]:
    """Group the faults by path; of the members of a union only those that got furthest count."""
    furthest = [fault.path for fault in faults if fault.in_union]
    groups: dict[tuple[KeyPath, str], list[_Fault]] = {}
    for fault in faults:
        deeper = any(len(path) > len(fault.path) and path[: len(fault.path)] == fault.path for path in furthest)
        if not (fault.in_union and deeper and fault.detail["type"].endswith("_type")) and not _follows(fault):
            groups.setdefault((fault.path, "" if fault.in_union else fault.detail["type"]), []).append(fault)
    return list(groups.values())


def _follows(fault: _Fault) -> bool:
    """Whether a list is only too short because items of it are faulty, which are reported by themselves."""
    items = fault.node.value if isinstance(fault.node.value, tuple) else ()
    return bool(fault.detail["type"] == "too_short" and len(items) >= fault.detail["ctx"]["min_length"])


def _message(faults: list[_Fault], annotation: Any, root: Node, data: Any, control: Control) -> str:
    """Write one line about one place; several faults there are those of the members of a union."""
    fault = faults[0]
    kind, path, node = fault.detail["type"], fault.path, fault.node
    place, got = node.place, _shown(node.data())
    if kind == "extra_forbidden":
        valid = [control.renamed(key) for key in keys_at(annotation, path[:-1], data)]
        place, got = _key_place(root, path), control.renamed(str(path[-1]))
        now = former_keys(annotation, path[:-1], data).get(str(path[-1]))
        text = _unknown(now or got, valid)
        if len(path) > 1 and got in keys_at(annotation, (), data):
            text = f"no such key here; it is one of the first column, so it may be indented too far (got {got})"
    elif "missing" in kind:
        text, got = "is missing", _shown(list(node.value) if isinstance(node.value, Mapping) else [])
    elif kind.startswith("union_tag"):
        context = fault.detail["ctx"]
        key = context["discriminator"].strip("'")
        tag = _below(node, key)
        path, place, got = (*path, key), (tag or node).place, _shown(tag.data() if tag else None)
        text = _one_of(context.get("expected_tags", ""), context.get("tag"))
    else:
        text = _alternatives([_worded(each) for each in faults])
        if fault.of_key:
            place, got = _key_place(root, path), control.renamed(str(path[-1]))
    shown = ".".join(control.renamed(str(part)) for part in path)
    shown = "" if place == f"--set {shown}" else shown
    return ": ".join(part for part in (place, shown, text) if part) + ("" if "(got" in text else f" (got {got})")


def _key_place(root: Node, path: KeyPath) -> str:
    node = root
    for part in path[:-1]:
        node = _below(node, part) or node
    return node.value[str(path[-1])].place if isinstance(node.value, Mapping) else node.place


def _unknown(given: str, valid: list[str]) -> str:
    near = nearest(given, valid)
    if near:
        return f"no such key; did you mean {near}?"
    return f"no such key; there is {', '.join(valid)}" if valid else "no such key here"


def _one_of(expected: str, given: Any) -> str:
    choices = re.findall(r"'([^']*)'", expected)
    near = nearest(given, choices) if isinstance(given, str) else None
    listed = ", ".join(choices) or expected
    return f"must be one of {listed}" + (f"; did you mean {near}?" if near else "")


def _worded(fault: _Fault) -> str:
    kind = fault.detail["type"]
    if kind == "literal_error":
        return _one_of(fault.detail["ctx"]["expected"], fault.node.value)
    if kind == "string_type" and isinstance(fault.node.value, int | float):
        return "must be text; put it in quotes"
    return worded(kind, str(fault.detail["msg"]))


def _alternatives(texts: list[str]) -> str:
    first, *others = dict.fromkeys(texts)
    return " or ".join([first, *(other.removeprefix("must be ") for other in others)])


def _shown(value: Any) -> str:
    text = value if isinstance(value, str) and value.isprintable() and value else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


# --- Names of the control signal: `voltage_V` in the code, `current_A` in files where the config says so ---


_WITH_UNIT, _WITHOUT_UNIT = "(?:at|between|end|from|passive|sd|start|to)_", "(?:best_fixed|fixed|left_out)_"
_BEHIND_CONTROL = r"s?(?:_\d+)?"
"""What stands around the name of the control in a key: one called u is no part of `unit`, s is none of `from_s`."""


def canonical(name: str, control: Control) -> str:
    """Return the canonical name of a column or key that bears the name of the control.

    Examples
    --------
    >>> canonical("current_1_A", Control("current", "A"))
    'voltage_1_V'
    """
    if control == Control():
        return name
    unit = control.quantity.column.removeprefix(control.name)
    whole = rf"{re.escape(control.name)}({_BEHIND_CONTROL})"
    found = re.fullmatch(rf"({_WITH_UNIT}|){whole}({re.escape(unit)})", name)
    found = found or re.fullmatch(rf"({_WITHOUT_UNIT}|){whole}()", name)
    if found is None:
        return name
    candidate = f"{found[1]}{VOLTAGE.name}{found[2]}" + (f"_{VOLTAGE.unit}" if found[3] else "")
    return candidate if control.renamed(candidate) == name else name


def canonical_nodes(root: Node, control: Control) -> Node:
    """Return the tree with every key of the control under its canonical name."""
    if control == Control() or not isinstance(root.value, Mapping | tuple):
        return root
    if isinstance(root.value, tuple):
        return collection(tuple(canonical_nodes(item, control) for item in root.value), root.place)
    entries: dict[str, Entry] = {}
    for key, entry in root.value.items():
        name = canonical(key, control)
        name = key if name in root.value else name  # both names stand here: the model refuses one of them
        entries[name] = Entry(entry.place, canonical_nodes(entry.node, control))
    return collection(entries, root.place)


def misnamed(root: Node, control: Control) -> list[str]:
    """List every key under its canonical name although the control has another name, with its place."""
    faults: list[str] = []
    if isinstance(root.value, tuple):
        for item in root.value:
            faults += misnamed(item, control)
    elif isinstance(root.value, Mapping):
        for key, entry in root.value.items():
            if control.renamed(key) != key:
                faults.append(f"{entry.place}: {key}: must be called {control.renamed(key)} here (got {key})")
            faults += misnamed(entry.node, control)
    return faults


# --- JSON artefacts: a validated model or a list of them, read back strictly ---

Model = TypeVar("Model", bound=Frozen)


def write_json(path: Path, content: Frozen | Sequence[Frozen] | Mapping[str, Any], control: Control) -> None:
    """Write a model, a list of models or plain data, keys of the control under its own name."""
    path.write_text(json_text(plain_data(content, control)) + "\n", encoding="utf-8", newline="\n")


def json_text(data: Any) -> str:
    """Write plain data as indented JSON, without a line break at its end."""
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False)


def plain_data(content: Any, control: Control) -> Any:
    """Return models, and lists and mappings of them, as plain data with keys of the control under its own name."""
    if isinstance(content, Frozen):
        content = content.model_dump(mode="json")
    if isinstance(content, Mapping):
        return {control.renamed(key): plain_data(value, control) for key, value in content.items()}
    return [plain_data(value, control) for value in content] if isinstance(content, list | tuple) else content


def read_json(path: Path, model: type[Model], control: Control) -> Model:
    """Read what `write_json` wrote (or a person edited).

    Raises
    ------
    DataError : when the file does not fit the model, with every place
    """
    found: Model = _read(path, model, control)
    return found


def read_json_list(path: Path, model: type[Model], control: Control) -> tuple[Model, ...]:
    """Read a list of models.

    Raises
    ------
    DataError : when the file is no list that fits the model, with every place
    """
    found: tuple[Model, ...] = _read(path, tuple[model, ...], control)  # type: ignore[valid-type]  # made at run time
    return found


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
    """Read the text once more as YAML, which includes JSON, for the places of the faults."""
    root = compose(text.replace("\t", " "), path, DataError)
    if faults := misnamed(root, control):
        raise DataError(faults)
    return validated(annotation, canonical_nodes(root, control), control, DataError)
