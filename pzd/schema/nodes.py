"""YAML text as a tree in which every value knows its place.

PyYAML splits the text into events; what the events mean is decided here: scalars by the YAML
1.2 core schema, keys as text and once only, no tags, nothing deeper than `DEEPEST`, aliases
only while they stay small.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

import yaml

from pzd.schema.errors import UserError, at
from pzd.schema.scalars import Scalar, scalar_of
from pzd.schema.syntax import explained

DEEPEST = 100
"""Nesting of lists and mappings beyond which a file is refused."""
MOST_VALUES = 1_000_000
"""Number of values, aliases written out, beyond which a file is refused."""


@dataclass(frozen=True)
class Entry:
    """One key of a mapping, and what stands under it."""

    place: str
    """Place of the key."""
    node: Node


@dataclass(frozen=True)
class Node:
    """One value of a file with its place."""

    value: Scalar | tuple[Node, ...] | Mapping[str, Entry]
    place: str
    """Where it stands, as ``file:line:column``."""
    count: int = 1
    """How many values it holds, itself included."""
    height: int = 0
    """How many lists and mappings are nested in it."""

    def data(self) -> Any:
        """The value as plain Python data."""
        if isinstance(self.value, tuple):
            return [item.data() for item in self.value]
        if isinstance(self.value, Mapping):
            return {key: entry.node.data() for key, entry in self.value.items()}
        return self.value


def collection(value: tuple[Node, ...] | Mapping[str, Entry], place: str) -> Node:
    """A list or mapping of nodes as one node."""
    parts = value if isinstance(value, tuple) else tuple(entry.node for entry in value.values())
    return Node(value, place, 1 + sum(p.count for p in parts), 1 + max((p.height for p in parts), default=0))


def compose(text: str, name: object, error: type[UserError]) -> Node:
    """The tree of a YAML text.

    Parameters
    ----------
    text : the text of one document
    name : what the text is called in places, its file
    error : the kind of error to raise

    Returns
    -------
    the root node

    Raises
    ------
    UserError : of the kind `error`, when the text is not one such document
    """
    composer = _Composer(name, yaml.parse(text, Loader=yaml.SafeLoader))
    try:
        root = composer.document()
    except _RefusedError:
        raise error(composer.faults) from None
    except yaml.MarkedYAMLError as fault:
        raise error([*composer.faults, _syntax(fault, text, name)]) from None
    except yaml.reader.ReaderError as fault:
        line, column = text.count("\n", 0, fault.position) + 1, fault.position - text.rfind("\n", 0, fault.position)
        code = f"U+{ord(text[fault.position]):04X}"
        raise error(f"{at(name, line, column)}: a character that YAML does not allow (got {code})") from None
    if composer.faults:
        raise error(composer.faults)
    return root


def _syntax(fault: yaml.MarkedYAMLError, text: str, name: object) -> str:
    found = explained(fault, text)
    return f"{at(name, found.line + 1, found.column + 1)}: {found.message}" if found else f"{at(name)}: {fault.problem}"


class _RefusedError(Exception):
    """A text that is not read any further."""


@dataclass
class _Composer:
    name: object
    events: Iterator[Any]
    faults: list[str] = field(default_factory=list)
    anchors: dict[str, Node | None] = field(default_factory=dict)
    aliased: int = 0

    def document(self) -> Node:
        """The only document of the text."""
        next(self.events)
        event = next(self.events)
        if isinstance(event, yaml.StreamEndEvent):
            self.refuse(f"{at(self.name)}: the file is empty")
        root = self.node(next(self.events), (), 0)
        next(self.events)
        event = next(self.events)
        if not isinstance(event, yaml.StreamEndEvent):
            self.refuse(f"{self.place(event)}: a second document begins here; one is allowed")
        return root

    def node(self, event: Any, path: tuple[str, ...], depth: int) -> Node:
        """The node that begins with this event."""
        if isinstance(event, yaml.AliasEvent):
            return self.alias(event, depth)
        if event.tag is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            self.fault(event, path, f"tags are not allowed; leave it out (got {tag})")
        if isinstance(event, yaml.ScalarEvent):
            made = Node(self.scalar(event, path), self.place(event))
        else:
            made = self.collection(event, path, depth)
        if event.anchor is not None:
            self.anchors[event.anchor] = made
        return made

    def collection(self, event: Any, path: tuple[str, ...], depth: int) -> Node:
        """The list or mapping that begins with this event."""
        if depth >= DEEPEST:
            self.refuse(f"{self.place(event)}: nested deeper than {DEEPEST} levels")
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        read = self.items if isinstance(event, yaml.SequenceStartEvent) else self.entries
        return collection(read(path, depth + 1), self.place(event))

    def items(self, path: tuple[str, ...], depth: int) -> tuple[Node, ...]:
        """The items of a list up to its end."""
        found: list[Node] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            found.append(self.node(event, (*path, str(len(found))), depth))
        return tuple(found)

    def entries(self, path: tuple[str, ...], depth: int) -> dict[str, Entry]:
        """The entries of a mapping up to its end."""
        found: dict[str, Entry] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            key = self.node(event, path, depth).value
            name = key if isinstance(key, str) else getattr(event, "value", "")
            if not isinstance(key, str):
                self.fault(event, path, f"a key must be text; put it in quotes (got {name or 'no text'})")
            elif key in found:
                self.fault(event, (*path, key), f"the key is given a second time (first at {found[key].place})")
            found[name] = Entry(self.place(event), self.node(next(self.events), (*path, name), depth))
        return found

    def scalar(self, event: Any, path: tuple[str, ...]) -> Scalar:
        """The value of a scalar, by the core schema where it is plain."""
        text: str = event.value
        if any(c == "\0" or "\ud800" <= c <= "\udfff" for c in text):
            self.fault(event, path, f"text with a character that no text has (got {text!r})")
            return ""
        if not event.implicit[0]:
            return text
        try:
            return scalar_of(text)
        except ValueError:
            self.fault(event, path, f"a number of {len(text)} digits is too long")
            return 0

    def alias(self, event: Any, depth: int) -> Node:
        """The node that an alias stands for."""
        if event.anchor not in self.anchors:
            self.refuse(f"{self.place(event)}: no anchor of this name stands before it (got *{event.anchor})")
        target = self.anchors[event.anchor]
        if target is None:
            self.refuse(f"{self.place(event)}: an alias inside its own anchor never ends (got *{event.anchor})")
        self.aliased += target.count
        if self.aliased > MOST_VALUES or depth + target.height > DEEPEST:
            self.refuse(f"{self.place(event)}: aliases that give more than {MOST_VALUES} values or {DEEPEST} levels")
        return target

    def place(self, event: Any) -> str:
        """Where an event begins."""
        return at(self.name, event.start_mark.line + 1, event.start_mark.column + 1)

    def fault(self, event: Any, path: tuple[str, ...], message: str) -> None:
        """Note a fault and read on."""
        self.faults.append(": ".join(part for part in (self.place(event), ".".join(path), message) if part))

    def refuse(self, message: str) -> NoReturn:
        """Note a fault and stop reading."""
        self.faults.append(message)
        raise _RefusedError
