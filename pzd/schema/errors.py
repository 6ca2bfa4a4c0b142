"""Errors that a user can cause, each with its exit code; texts of files; wording of messages."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self


class UserError(Exception):
    """A fault that the user can mend; all messages of one cause are raised at once."""

    exit_code: ClassVar[int]

    def __init__(self, messages: str | Iterable[str]) -> None:
        self.messages = (messages,) if isinstance(messages, str) else tuple(messages)
        super().__init__("\n".join(self.messages))

    def __reduce__(self) -> tuple[type[Self], tuple[tuple[str, ...]]]:
        """Keep the messages apart on the way to another process."""
        return type(self), (self.messages,)


class ConfigError(UserError):
    """A wrong config or a wrong use of a command."""

    exit_code = 2


class DataError(UserError):
    """Rig files or artefacts that cannot be used."""

    exit_code = 3


class FilesError(UserError):
    """Files, disk or locks that cannot be used."""

    exit_code = 5


@dataclass(frozen=True)
class Advice:
    """What to say under one key of an entry of `rig.files`, so that a file is read as it was meant."""

    key: str
    """`sign`, `units`, `rate_Hz`, `split` or `columns`"""
    value: str
    """As it is written in the config."""
    quantity: str | None = None
    """What it is about, where the key has one value for each quantity."""
    when: str = ""
    """Behind it: where or whether this is the one."""

    def __str__(self) -> str:
        """Return it as it is written in the config."""
        value = self.value if self.quantity is None else f"{{{self.quantity}: {self.value}}}"
        return f"{self.key}: {value}{self.when and f' {self.when}'}"


class Advised(str):
    """A message about a file that ends in advice: who gives no file words it from what it says."""

    __slots__ = ("advice", "fault")

    fault: str
    """Up to the advice."""
    advice: tuple[Advice, ...]

    def __new__(cls, fault: str, *advice: Advice) -> Self:
        """Make the message from the fault, up to the advice, and from one or several ways to mend it."""
        made = super().__new__(cls, f"{fault} say {', or '.join(map(str, advice))}")
        made.fault, made.advice = fault, advice
        return made

    def __reduce__(self) -> tuple[type[Self], tuple[str | Advice, ...]]:
        """Keep fault and advice apart on the way to another process."""
        return type(self), (self.fault, *self.advice)

    def worded(self, how: Callable[[Advice], str | None]) -> str:
        """Return the message with each advice in other words; None where it says nothing elsewhere."""
        told = dict.fromkeys(words for words in map(how, self.advice) if words is not None)
        return f"{self.fault} {', or '.join(told)}" if told else self.fault.rstrip("; ")


def at(path: object, line: int | None = None, column: int | None = None) -> str:
    """Return the place of an error as ``file:line:column``, as far as it is known."""
    return ":".join(str(part) for part in (path, line, column) if part is not None)


class InsideError(ValueError):
    """A fault of one key or item that a validator of the whole value finds."""

    def __init__(self, message: str, *path: str | int, of_key: bool = False) -> None:
        """Make the fault.

        Parameters
        ----------
        message : what the key or item must be
        path : keys and indices from the value to it
        of_key : whether the last key itself is wrong, not its value
        """
        super().__init__(message)
        self.path = path
        self.of_key = of_key


def no_file(path: Path, given: str | None = None) -> str:
    """Say that a path is no file: a folder, in which files are to be named, or nothing.

    Parameters
    ----------
    path : that is no file
    given : how it was written; None for the path itself
    """
    if path.is_dir():
        endings = Counter(file.suffix for file in path.iterdir() if file.is_file() and file.suffix)
        ending = max(endings, key=lambda one: endings[one], default=".csv")
        return f"this is a folder; name the files in it, e.g. {(given or str(path)).rstrip('/')}/*{ending}"
    return "no such file; check the path"


def read_text(path: Path, missing: type[UserError], advice: str) -> str:
    """Read the text of a UTF-8 file, without a byte order mark.

    Raises
    ------
    UserError : of the kind `missing` when the file is absent, no file, or not UTF-8 text
    FilesError : when the file is there and cannot be read
    """
    try:
        return path.read_bytes().decode("utf-8-sig")
    except (FileNotFoundError, NotADirectoryError):
        raise missing(f"{at(path)}: the file is missing; {advice}") from None
    except IsADirectoryError:
        raise missing(f"{at(path)}: this is a folder, a file is needed") from None
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise missing(f"{at(path, line)}: not UTF-8 text ({error.reason}); save the file as UTF-8") from None
    except OSError as error:
        raise FilesError(f"{at(path)}: {error.strerror}") from None


# --- Wording of messages: significant digits, counted nouns, faults of pydantic ---

MOST_DIGITS = 6
"""Most significant digits of a number, however narrow its interval."""

_WORDS = {
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be text",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "dict_type": "must be a mapping",
    "model_type": "must be a mapping",
    "model_attributes_type": "must be a mapping",
}


def supported(value: float, low: float, high: float) -> str:
    """Write a number to the second digit of the width of its interval; far less than the interval is 0.

    Examples
    --------
    >>> supported(2713.4, 2650.0, 2790.0)
    '2710'
    """
    width = high - low
    if not (math.isfinite(width) and width > 0.0):
        return f"{value:.4g}"
    return f"{round(value, 1 - math.floor(math.log10(width))) + 0.0:.{MOST_DIGITS}g}"


def rounded_as(value: float, other: float, digits: int) -> float:
    """Round a value to the decimal place of the last of so many digits of another one, from which it was read."""
    if other == 0.0 or not math.isfinite(other):
        return value
    return round(value, digits - 1 - math.floor(math.log10(abs(other)))) + 0.0


def counted(count: int, noun: str) -> str:
    """Write a count with its noun: 1 record, 2 records."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def worded(kind: str, message: str) -> str:
    """Write what a value must be, by pydantic's kind of error and its message."""
    plain = re.sub(r"^(Input|String|Tuple|List|Dictionary|Value) should", "must", message.removeprefix("Value error, "))
    return _WORDS.get(kind, plain.replace(" after validation", ""))
