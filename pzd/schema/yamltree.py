"""YAML text as a tree of nodes that know their places, and likely mistakes behind syntax errors.

PyYAML splits the text into events. The meaning of the events is decided here, as no library has all of it: scalars of
the YAML 1.2 core schema without coercion, the place of every key and value, keys that are text and unique, no tags,
nothing nested deeper than `DEEPEST`, aliases only while they stay small, merge keys. ruamel.yaml 0.19 reads 1_000, 0b1
and 2020-01-01 as numbers and dates, takes tags, keys of any type and aliases inside of their anchors, knows no limits,
and has the syntax errors of PyYAML ("expected ',' or ']', but got ':'" in the line after a bracket that is not
closed). It would replace a quarter of this file at most. `explained` finds the mistake behind such an error, and its
remedy.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

import yaml

from pzd.schema.errors import UserError, at

# --- Scalars of the YAML 1.2 core schema: no yes, no, on or off, no dates, no base 60 ---

Scalar = None | bool | int | float | str

_WORDS: dict[str, Scalar] = {"": None, "~": None}
for _word, _value in (("null", None), ("true", True), ("false", False)):
    _WORDS |= {_word: _value, _word.capitalize(): _value, _word.upper(): _value}
_READERS: tuple[tuple[re.Pattern[str], Callable[[str], int | float]], ...] = (
    (re.compile(r"[-+]?[0-9]+"), int),
    (re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+"), lambda text: int(text, 0)),
    (re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"), float),
    (re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"), lambda text: float(text.replace(".", ""))),
)

_PLAIN = re.compile(r"[A-Za-z0-9_./+-]([A-Za-z0-9_./+*%() -]*[A-Za-z0-9_./+*%()-])?")
_OLD_WORDS = frozenset(("y", "n", "yes", "no", "on", "off"))  # text here, truth values in YAML 1.1
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def scalar_of(text: str) -> Scalar:
    """Read a plain scalar.

    Raises
    ------
    ValueError : when an integer is longer than can be read

    Examples
    --------
    >>> [scalar_of(text) for text in ("1e3", "no", "~")]
    [1000.0, 'no', None]
    """
    if text in _WORDS:
        return _WORDS[text]
    for pattern, read in _READERS:
        if pattern.fullmatch(text):
            return read(text)
    return text


def written(value: Scalar) -> str:
    """Write a scalar as YAML that reads back as the same value."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value if _reads_as_text(value) else '"' + "".join(_escaped(c) for c in value) + '"'
    if isinstance(value, int) or math.isfinite(value):
        return repr(value)
    return ".nan" if math.isnan(value) else f"{'-' if value < 0 else ''}.inf"


def _reads_as_text(text: str) -> bool:
    if not _PLAIN.fullmatch(text) or text.lower() in _OLD_WORDS or text in ("-", "---", "..."):
        return False
    if text.startswith(("- ", "--- ", "... ")):
        return False
    starts_like_a_number = text[0] in "0123456789+-." and " " not in text
    return isinstance(scalar_of(text), str) and not starts_like_a_number


def _escaped(character: str) -> str:
    if character in _ESCAPES:
        return _ESCAPES[character]
    code = ord(character)
    if character.isprintable():
        return character
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


# --- Likely mistake behind a syntax error: the parser may give up far behind it ---

_CLOSING = {"{": "}", "[": "]"}
_NO_COLON = re.compile(r"(?:- +)*(?P<key>[A-Za-z_]\w*) +(?P<value>[^\s:#].*)|(?:- +)*(?P<alone>[A-Za-z_]\w*)")
"""One or several words without a colon behind the first."""
_NO_BLANK = re.compile(r"(?:- +)*(?P<key>[A-Za-z_]\w*):(?P<value>[^\s:].*)")
_KEY = re.compile(r"(?:- +)*[\"']?[A-Za-z_][\w .-]*[\"']?:(?: |$)")


Mistake = tuple[int, int, str]
"""Line and column, both from 0, and what is wrong there."""


def explained(error: yaml.MarkedYAMLError, mark: yaml.Mark, text: str) -> Mistake:
    """Find the likely mistake behind an error of the parser.

    Parameters
    ----------
    error : of the parser
    mark : place of the error
    text : the whole text
    """
    problem, context, opened = str(error.problem), str(error.context), error.context_mark
    lines = text.splitlines() or [""]
    line, column = min(mark.line, len(lines) - 1), mark.column
    indent = lines[line][: len(lines[line]) - len(lines[line].lstrip())]
    if "\t" in indent:
        return line, indent.index("\t"), "a tab where YAML wants spaces; indent with spaces"
    if opened is not None and "quoted scalar" in context and "end of" in problem:
        return opened.line, opened.column, "the quote that opens here is not closed; put the same quote at its end"
    if found := (_in_brackets(error, lines, line, column) or _key(lines, line)):
        return found
    character = lines[line][column : column + 1]
    if character in ("}", "]"):
        return line, column, f"this {character} closes nothing; take it away, or open the bracket before it"
    if "mapping values" in problem and re.search(r":\s", lines[line][:column]):
        return line, column, "a second colon in one line; put the text in quotes, or begin a new line"
    parser = mark.line, mark.column, problem + (f" ({error.context})" if error.context else "")
    return _indent(problem, lines, line) or parser


def _in_brackets(error: yaml.MarkedYAMLError, lines: list[str], line: int, column: int) -> Mistake | None:
    """Find a bracket that is not closed, else a comma that is missing inside of it."""
    mark = error.context_mark
    if mark is None or "flow" not in str(error.context) or mark.line >= len(lines):
        return None
    opening = lines[mark.line][mark.column : mark.column + 1]
    if opening not in _CLOSING:
        return None
    if not _closes(lines, mark.line, mark.column):
        say = f"the {opening} that opens here is not closed; put {_CLOSING[opening]} at its end"
        return mark.line, mark.column, say
    # The parser stops at the next entry, or at its colon where it took the key for more of the value before.
    word = re.search(r"\S+\s*$", lines[line][:column]) if lines[line][column : column + 1] == ":" else None
    return line, word.start() if word else column, "a comma is missing before this; write it between two entries"


def _closes(lines: list[str], line: int, column: int) -> bool:
    """Whether the bracket there is closed before a line that begins a key in the block around it."""
    outer = len(lines[line]) - len(lines[line].lstrip())
    depth = 0
    for number in range(line, len(lines)):
        content = _uncommented(lines[number])
        indent = len(content) - len(content.lstrip())
        if number > line and indent <= outer and _KEY.match(content.strip()):
            return False
        for character in re.sub(r"'[^']*'|\"[^\"]*\"", "", content[column if number == line else 0 :]):
            depth += (character in "{[") - (character in "}]")
            if depth == 0:
                return True
    return False


def _key(lines: list[str], line: int) -> Mistake | None:
    """Find a key without a colon, or without a blank behind it, in this line or the last filled one above it."""
    above = next((n for n in range(line - 1, -1, -1) if _uncommented(lines[n]).strip()), line)
    for number in dict.fromkeys((above, line)):
        content = _uncommented(lines[number])
        start = len(content) - len(content.lstrip())
        if found := _NO_BLANK.fullmatch(content.strip()):
            say = f"a blank is missing behind the colon; write {found['key']}: {found['value']}"
            return number, start + found.start("key"), say
        if found := _NO_COLON.fullmatch(content.strip()):
            key = found["key"] or found["alone"]
            say = f"a colon is missing behind the key; write {key}: {found['value'] or ''}".rstrip()
            return number, start + found.start("key" if found["key"] else "alone"), say
    return None


def _indent(problem: str, lines: list[str], line: int) -> Mistake | None:
    """Find a line that begins in another column than its neighbours."""
    content = lines[line]
    if not _KEY.match(content.strip()) and not content.lstrip().startswith("- "):
        return None
    if not any(word in problem for word in ("block", "mapping values", "sequence entries", "indent")):
        return None
    say = "the line is indented otherwise than those around it; keys of one block begin in one column"
    first = next(n for n, each in enumerate(lines) if _uncommented(each).strip())
    if content[:1] not in (" ", "-") and lines[first][:1] == " ":  # not this line, but the first one is too far in
        line, content = first, lines[first]
    return line, len(content) - len(content.lstrip()), say


def _uncommented(line: str) -> str:
    return re.sub(r"(^|\s)#.*$", "", line).rstrip()


# --- Nodes ---

DEEPEST = 100
"""Nesting of lists and mappings beyond which a file is refused."""
MOST_VALUES = 1_000_000
"""Number of values, aliases written out, beyond which a file is refused."""


@dataclass(frozen=True)
class Entry:
    """One key of a mapping, and the node of its value."""

    place: str
    """Place of the key."""
    node: Node


@dataclass(frozen=True)
class Node:
    """One value of a file with its place."""

    value: Scalar | tuple[Node, ...] | Mapping[str, Entry]
    place: str
    """Its place as ``file:line:column``."""
    count: int = 1
    """Number of values in it, itself included."""
    height: int = 0
    """Depth of the lists and mappings in it."""

    def data(self) -> Any:
        """Return the value as plain Python data."""
        if isinstance(self.value, tuple):
            return [item.data() for item in self.value]
        if isinstance(self.value, Mapping):
            return {key: entry.node.data() for key, entry in self.value.items()}
        return self.value


def collection(value: tuple[Node, ...] | Mapping[str, Entry], place: str) -> Node:
    """Make one node of a list or mapping of nodes."""
    parts = value if isinstance(value, tuple) else tuple(entry.node for entry in value.values())
    return Node(value, place, 1 + sum(p.count for p in parts), 1 + max((p.height for p in parts), default=0))


def node_of(data: Any, key: str = "") -> Node:
    """Make a tree of plain Python data, as arguments of a function hold; what came from no file has no place.

    Parameters
    ----------
    data : mappings, lists, tuples and arrays of scalars
    key : where they stand, for messages

    Raises
    ------
    TypeError : when something in it is none of these
    """
    if isinstance(data, Mapping):
        entries = {str(name): Entry("", node_of(value, f"{key}.{name}".lstrip("."))) for name, value in data.items()}
        return collection(entries, "")
    if hasattr(data, "tolist"):  # an array, or one of its numbers
        data = data.tolist()
    if isinstance(data, list | tuple):
        return collection(tuple(node_of(item, key) for item in data), "")
    if data is not None and not isinstance(data, bool | int | float | str):
        raise TypeError(
            f"{key}: must be text, a number, true or false, a list or a mapping (got {type(data).__name__})"
        )
    return Node(data, "")


def compose(text: str, name: object, error: type[UserError]) -> Node:
    """Build the tree of a YAML text.

    Parameters
    ----------
    text : the text of one document
    name : of the text in places, its file
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
    mark = fault.problem_mark or fault.context_mark
    if mark is None:
        return f"{at(name)}: {fault.problem}"
    line, column, message = explained(fault, mark, text)
    return f"{at(name, line + 1, column + 1)}: {message}"


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
        """Build the only document of the text."""
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
        """Build the node that begins with this event."""
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
        """Build the list or mapping that begins with this event."""
        if depth >= DEEPEST:
            self.refuse(f"{self.place(event)}: nested deeper than {DEEPEST} levels")
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        read = self.items if isinstance(event, yaml.SequenceStartEvent) else self.entries
        return collection(read(path, depth + 1), self.place(event))

    def items(self, path: tuple[str, ...], depth: int) -> tuple[Node, ...]:
        """Build the items of a list up to its end."""
        found: list[Node] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            found.append(self.node(event, (*path, str(len(found))), depth))
        return tuple(found)

    def entries(self, path: tuple[str, ...], depth: int) -> dict[str, Entry]:
        """Build the entries of a mapping up to its end; those merged by ``<<`` stand behind its own."""
        found: dict[str, Entry] = {}
        merged: dict[str, Entry] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            key = self.node(event, path, depth).value
            name = key if isinstance(key, str) else getattr(event, "value", "")
            if not isinstance(key, str):
                self.fault(event, path, f"a key must be text; put it in quotes (got {name or 'no text'})")
            elif key in found:
                self.fault(event, (*path, key), f"the key is given a second time (first at {found[key].place})")
            node = self.node(next(self.events), (*path, name), depth)
            if name == "<<" and event.implicit[0]:
                merged = self.merged(event, path, node) | merged
            else:
                found[name] = Entry(self.place(event), node)
        return found | {key: entry for key, entry in merged.items() if key not in found}

    def merged(self, event: Any, path: tuple[str, ...], node: Node) -> dict[str, Entry]:
        """Return the entries that a merge key adds, of a mapping or a list of them; the first that has a key wins.

        Merge keys are of YAML 1.1 (https://yaml.org/type/merge.html), and used wherever anchors are.
        """
        sources = node.value if isinstance(node.value, tuple) else (node,)
        found: dict[str, Entry] = {}
        for source in sources:
            if isinstance(source.value, Mapping):
                found = {**source.value, **found}
            else:
                self.fault(event, path, f"<< must give a mapping, such as <<: *name (got {source.data()})")
        return found

    def scalar(self, event: Any, path: tuple[str, ...]) -> Scalar:
        """Read a scalar, by the core schema where it is plain."""
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
        """Return the node that an alias stands for."""
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
        """Return the place where an event begins."""
        return at(self.name, event.start_mark.line + 1, event.start_mark.column + 1)

    def fault(self, event: Any, path: tuple[str, ...], message: str) -> None:
        """Note a fault and read on."""
        self.faults.append(": ".join(part for part in (self.place(event), ".".join(path), message) if part))

    def refuse(self, message: str) -> NoReturn:
        """Note a fault and stop reading."""
        self.faults.append(message)
        raise _RefusedError
