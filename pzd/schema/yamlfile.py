"""YAML 1.2 files: read with the place of every value, extended, overridden from the command line, written plainly."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self, TypeVar

from pzd.quantities import Control
from pzd.schema.errors import ConfigError, DataError, UserError, read_text
from pzd.schema.model import Frozen
from pzd.schema.validate import canonical_nodes, misnamed, plain_data, validated
from pzd.schema.yamltree import Entry, Node, collection, compose, node_of, written

Model = TypeVar("Model", bound=Frozen)


@dataclass(frozen=True)
class Document:
    """One YAML document: plain data, and the place of each value."""

    path: Path
    root: Node
    error: type[UserError] = ConfigError
    """Kind of error for a fault in it."""

    @property
    def data(self) -> Any:
        """The document as plain Python data."""
        return self.root.data()

    def place(self, path: Iterable[str], message: str = "") -> str:
        """Return the place of a value by its keys and indices, or of the deepest node on the way to it.

        Parameters
        ----------
        path : keys and indices
        message : about the value; where it begins with a key of the value, the place is that of the value under this
            key, or of the key itself where the message ends with it, as in ``mas: no such key (got 'mas')``
        """
        node = self.root
        for part in path:
            below = node.value.get(part) if isinstance(node.value, Mapping) else None
            if below is not None:
                node = below.node
            elif isinstance(node.value, tuple) and part.isdecimal() and int(part) < len(node.value):
                node = node.value[int(part)]
        key = message.partition(": ")[0]
        if not isinstance(node.value, Mapping) or key not in node.value:
            return node.place
        entry = node.value[key]
        return entry.place if message.endswith((f"(got {key!r})", f"(got {key})")) else entry.node.place

    def overridden(self, overrides: Iterable[str]) -> Self:
        """Return the document with ``a.b=VALUE`` set, VALUE one YAML scalar; items of lists by index.

        Raises
        ------
        ConfigError : when an override cannot be read or has no place in the document, all at once
        """
        root = self.root
        faults: list[str] = []
        for override in overrides:
            try:
                root = _with(root, override)
            except ConfigError as error:
                faults += error.messages
        if faults:
            raise ConfigError(faults)
        return replace(self, root=root)

    def validated(self, model: type[Model], control: Control) -> Model:
        """Validate the document against a model.

        The keys of the control signal may stand under the control's own name.

        Raises
        ------
        UserError : of the document's kind, with every fault at once
        """
        found: Model = validated(model, canonical_nodes(self.root, control), control, self.error)
        return found


def document_of(data: Mapping[str, Any]) -> Document:
    """Return plain Python data as a document, for messages in the words that a file has.

    Raises
    ------
    TypeError : when something in it is no plain data
    """
    return Document(Path(), node_of(data))


def read_yaml(path: Path, error: type[UserError] = ConfigError) -> Document:
    """Read one YAML document.

    Raises
    ------
    UserError : of the kind `error`, when it is not one, with the places
    """
    return Document(path, compose(read_text(path, error, "check the path"), path, error), error)


def read_yaml_model(path: Path, model: type[Model], control: Control) -> Model:
    """Read an artefact that `write_yaml_model` wrote (or a person edited).

    Raises
    ------
    DataError : when the file does not fit the model, with every place
    """
    document = read_yaml(path, DataError)
    if faults := misnamed(document.root, control):
        raise DataError(faults)
    return document.validated(model, control)


def write_yaml_model(path: Path, model: Frozen, control: Control) -> None:
    """Write a model with every default, in the order of its fields, so that it reads back equal."""
    path.write_text(yaml_text(model, control), encoding="utf-8", newline="\n")


def yaml_text(model: Frozen, control: Control) -> str:
    """Write a model as YAML, keys of the control under its own name."""
    return "".join(f"{line}\n" for line in _lines(plain_data(model, control)))


def _with(root: Node, override: str) -> Node:
    path, equals, text = override.partition("=")
    name = f"--set {path}"
    if not equals or not all(path.split(".")):
        raise ConfigError(f"--set {override}: must read a.b=VALUE (got {override})")
    try:
        value = compose(text, name, ConfigError) if text.strip() else Node(None, name)
    except ConfigError as error:
        reason = error.messages[0].rpartition(": ")[2]
        raise ConfigError(f"{name}: VALUE must be one YAML scalar; put text in quotes: {reason} (got {text})") from None
    items = value.value if isinstance(value.value, tuple) else (value,)
    if any(isinstance(item.value, tuple | Mapping) for item in items):
        raise ConfigError(f"{name}: VALUE must be one YAML scalar, or a list of them: [a, b] (got {text})")
    given = collection(value.value, name) if isinstance(value.value, tuple) else Node(value.value, name)
    return _put(root, path.split("."), given, name)


def _put(node: Node, path: list[str], value: Node, name: str) -> Node:
    if not path:
        return value
    key, rest = path[0], path[1:]
    if isinstance(node.value, tuple):
        if not (key.isdecimal() and int(key) < len(node.value)):
            size = f"{len(node.value)} item{'s' * (len(node.value) != 1)}"
            raise ConfigError(f"{name}: the list here has {size}, counted from 0 (got {key})")
        items = list(node.value)
        items[int(key)] = _put(items[int(key)], rest, value, name)
        return collection(tuple(items), node.place)
    if node.value is not None and not isinstance(node.value, Mapping):
        raise ConfigError(f"{name}: a single value stands before {key}, it has no keys (got {written(node.value)})")
    entries = dict(node.value or {})
    old = entries.get(key, Entry(name, Node(None, name)))
    entries[key] = Entry(old.place, _put(old.node, rest, value, name))
    return collection(entries, node.place)


def _lines(data: Any) -> Iterator[str]:
    if isinstance(data, Mapping) and data:
        for key, value in data.items():
            yield from _under(f"{written(key)}:", value)
    elif isinstance(data, list) and any(isinstance(item, Mapping | list) and item for item in data):
        for item in data:
            inner = list(_lines(item))
            yield f"- {inner[0]}"
            yield from (f"  {line}" for line in inner[1:])
    else:
        yield _flow(data)


def _under(head: str, value: Any) -> Iterator[str]:
    inner = list(_lines(value))
    if isinstance(value, Mapping | list) and value and not inner[0].startswith("["):
        yield head
        yield from (f"  {line}" for line in inner)
    else:
        yield f"{head} {inner[0]}"


def _flow(data: Any) -> str:
    if isinstance(data, list):
        return f"[{', '.join(_flow(item) for item in data)}]"
    return "{}" if isinstance(data, Mapping) else written(data)


# --- A config that extends another one, key by key ---

KEY = "extends"
"""Key with the name of the other config."""


def read_extended(path: Path, seen: tuple[Path, ...] = ()) -> Document:
    """Read a config with all that it extends.

    Mappings are merged key by key; a list, or a single value, replaces that of the other config. Every value keeps its
    place, in whichever file.

    Parameters
    ----------
    path : the config
    seen : configs that led here

    Raises
    ------
    ConfigError : when a config cannot be read, extends itself, or extends one in another folder
    """
    document = read_yaml(path)
    entries = document.root.value
    if not isinstance(entries, Mapping) or KEY not in entries or entries[KEY].node.value is None:
        return document
    named = entries[KEY].node
    name, place = named.value, named.place
    if not isinstance(name, str) or not name or Path(name).name != name:
        raise ConfigError(
            f"{place}: {KEY}: must be the name of a config beside this one, as its paths count from there "
            f"(got {named.data()})"
        )
    other = path.parent / name
    if other.resolve() in {each.resolve() for each in (*seen, path)}:
        raise ConfigError(f"{place}: {KEY}: a config that extends itself never ends; name another one (got {name})")
    if not other.is_file():
        raise ConfigError(f"{place}: {KEY}: no such file in {path.parent}; check the name (got {name})")
    base = read_extended(other, (*seen, path))
    own = {key: entry for key, entry in entries.items() if key != KEY}
    return replace(document, root=_merged(base.root, collection(own, document.root.place)))


def chain(path: Path) -> tuple[Path, ...]:
    """Return a config, the one that it extends, and so on, as far as they can be read."""
    found = [path]
    while True:
        try:
            entries = read_yaml(found[-1]).root.value
        except UserError:
            return tuple(found)
        named = entries.get(KEY) if isinstance(entries, Mapping) else None
        other = path.parent / str(named.node.value) if named else path
        if other in found:
            return tuple(found)
        found.append(other)


def _merged(base: Node, own: Node) -> Node:
    """Merge one node over another."""
    if not isinstance(base.value, Mapping) or not isinstance(own.value, Mapping):
        return own
    entries = dict(base.value)
    for key, entry in own.value.items():
        before = entries.get(key)
        entries[key] = Entry(entry.place, _merged(before.node, entry.node)) if before else entry
    return collection(entries, own.place)
