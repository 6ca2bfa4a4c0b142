"""A config that extends another one: what it says goes over what that one says, key by key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from pzd.schema.errors import ConfigError, UserError
from pzd.schema.nodes import Entry, Node, collection
from pzd.schema.yamlfile import Document, read_yaml

KEY = "extends"
"""Names the other config."""


def read_extended(path: Path, seen: tuple[Path, ...] = ()) -> Document:
    """Read a config with all that it extends.

    Mappings are put together key by key; a list, or a single value, takes the place of that of the other config.
    Every value keeps the place where it stands, in whichever file.

    Parameters
    ----------
    path : the config
    seen : those that led here

    Raises
    ------
    ConfigError : when a config cannot be read, extends itself, or extends one in another folder
    """
    document = read_yaml(path)
    entries = document.root.value
    named = entries.get(KEY) if isinstance(entries, Mapping) else None
    if not isinstance(entries, Mapping) or named is None or named.node.value is None:
        return document
    name, place = named.node.value, named.node.place
    if not isinstance(name, str) or not name or Path(name).name != name:
        raise ConfigError(
            f"{place}: {KEY}: must be the name of a config beside this one, as its paths count from there "
            f"(got {named.node.data()})"
        )
    other = path.parent / name
    if other.resolve() in {each.resolve() for each in (*seen, path)}:
        raise ConfigError(f"{place}: {KEY}: a config that extends itself never ends; name another one (got {name})")
    if not other.is_file():
        raise ConfigError(f"{place}: {KEY}: no such file in {path.parent}; check the name (got {name})")
    base = read_extended(other, (*seen, path))
    own = {key: entry for key, entry in entries.items() if key != KEY}
    return replace(document, root=_over(base.root, collection(own, document.root.place)))


def chain(path: Path) -> tuple[Path, ...]:
    """A config, the one that it extends, and so on, as far as they can be read."""
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


def _over(base: Node, own: Node) -> Node:
    """One node over another."""
    if not isinstance(base.value, Mapping) or not isinstance(own.value, Mapping):
        return own
    entries = dict(base.value)
    for key, entry in own.value.items():
        before = entries.get(key)
        entries[key] = Entry(entry.place, _over(before.node, entry.node)) if before else entry
    return collection(entries, own.place)
