"""Where a text that is no YAML is at fault, and what to do: the parser may give up far behind the mistake."""

from __future__ import annotations

import re
from dataclasses import dataclass

import yaml

_CLOSING = {"{": "}", "[": "]"}
_NO_COLON = re.compile(r"(?:- +)*(?P<key>[A-Za-z_]\w*) +(?P<value>[^\s:#].*)|(?:- +)*(?P<alone>[A-Za-z_]\w*)")
"""A line of one or several words without a colon behind the first."""
_NO_BLANK = re.compile(r"(?:- +)*(?P<key>[A-Za-z_]\w*):(?P<value>[^\s:].*)")
_KEY = re.compile(r"(?:- +)*[\"']?[A-Za-z_][\w .-]*[\"']?:(?: |$)")


@dataclass(frozen=True)
class Fault:
    """What is wrong in a text; line and column count from 0."""

    line: int
    column: int
    message: str


def explained(error: yaml.MarkedYAMLError, text: str) -> Fault | None:
    """The likely mistake behind what the parser says; None where it names no place.

    Parameters
    ----------
    error : of the parser
    text : the whole text
    """
    mark = error.problem_mark or error.context_mark
    if mark is None:
        return None
    lines = text.splitlines() or [""]
    line, column = min(mark.line, len(lines) - 1), mark.column
    return (
        _tab(lines, line)
        or _open_quote(error)
        or _in_brackets(error, lines, line, column)
        or _key(lines, line)
        or _closing(lines, line, column)
        or _second_colon(error, lines, line, column)
        or _indent(error, lines, line)
        or Fault(mark.line, mark.column, f"{error.problem}" + (f" ({error.context})" if error.context else ""))
    )


def _tab(lines: list[str], line: int) -> Fault | None:
    """A tab in the indent of a line."""
    indent = lines[line][: len(lines[line]) - len(lines[line].lstrip())]
    if "\t" not in indent:
        return None
    return Fault(line, indent.index("\t"), "a tab where YAML wants spaces; indent with spaces")


def _open_quote(error: yaml.MarkedYAMLError) -> Fault | None:
    mark = error.context_mark
    if mark is None or "quoted scalar" not in str(error.context) or "end of" not in str(error.problem):
        return None
    return Fault(mark.line, mark.column, "the quote that opens here is not closed; put the same quote at its end")


def _in_brackets(error: yaml.MarkedYAMLError, lines: list[str], line: int, column: int) -> Fault | None:
    """A bracket that is not closed, else a comma that is missing inside of it."""
    mark = error.context_mark
    if mark is None or "flow" not in str(error.context) or mark.line >= len(lines):
        return None
    opening = lines[mark.line][mark.column : mark.column + 1]
    if opening not in _CLOSING:
        return None
    if not _closes(lines, mark.line, mark.column):
        say = f"the {opening} that opens here is not closed; put {_CLOSING[opening]} at its end"
        return Fault(mark.line, mark.column, say)
    # The parser stops at the next entry, or at its colon where it took the key for more of the value before.
    word = re.search(r"\S+\s*$", lines[line][:column]) if lines[line][column : column + 1] == ":" else None
    return Fault(line, word.start() if word else column, "a comma is missing before this; write it between two entries")


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


def _key(lines: list[str], line: int) -> Fault | None:
    """A key without a colon, or without a blank behind it, in this line or the last one above it with a content."""
    above = next((n for n in range(line - 1, -1, -1) if _uncommented(lines[n]).strip()), line)
    for number in dict.fromkeys((above, line)):
        content = _uncommented(lines[number])
        start = len(content) - len(content.lstrip())
        if found := _NO_BLANK.fullmatch(content.strip()):
            say = f"a blank is missing behind the colon; write {found['key']}: {found['value']}"
            return Fault(number, start + found.start("key"), say)
        if found := _NO_COLON.fullmatch(content.strip()):
            key = found["key"] or found["alone"]
            say = f"a colon is missing behind the key; write {key}: {found['value'] or ''}".rstrip()
            return Fault(number, start + found.start("key" if found["key"] else "alone"), say)
    return None


def _closing(lines: list[str], line: int, column: int) -> Fault | None:
    character = lines[line][column : column + 1]
    if character not in ("}", "]"):
        return None
    return Fault(line, column, f"this {character} closes nothing; take it away, or open the bracket before it")


def _second_colon(error: yaml.MarkedYAMLError, lines: list[str], line: int, column: int) -> Fault | None:
    if "mapping values" not in str(error.problem) or not re.search(r":\s", lines[line][:column]):
        return None
    return Fault(line, column, "a second colon in one line; put the text in quotes, or begin a new line")


def _indent(error: yaml.MarkedYAMLError, lines: list[str], line: int) -> Fault | None:
    """A line that begins in another column than its neighbours."""
    content = lines[line]
    if not _KEY.match(content.strip()) and not content.lstrip().startswith("- "):
        return None
    if not any(word in str(error.problem) for word in ("block", "mapping values", "sequence entries", "indent")):
        return None
    say = "the line is indented otherwise than those around it; keys of one block begin in one column"
    first = next(n for n, each in enumerate(lines) if _uncommented(each).strip())
    if content[:1] not in (" ", "-") and lines[first][:1] == " ":  # not this line, but the first one is too far in
        line, content = first, lines[first]
    return Fault(line, len(content) - len(content.lstrip()), say)


def _uncommented(line: str) -> str:
    return re.sub(r"(^|\s)#.*$", "", line).rstrip()
