"""The errors that a user can cause, each with the exit code of the contract."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar


class UserError(Exception):
    """Something the user can mend; all messages of one cause are raised at once."""

    exit_code: ClassVar[int]

    def __init__(self, messages: str | Iterable[str]) -> None:
        self.messages = (messages,) if isinstance(messages, str) else tuple(messages)
        super().__init__("\n".join(self.messages))


class ConfigError(UserError):
    """A wrong config or a wrong use of a command."""

    exit_code = 2


class DataError(UserError):
    """Rig files or artefacts that cannot be used."""

    exit_code = 3


class FilesError(UserError):
    """Files, disk or locks that stand in the way."""

    exit_code = 5


def at(path: object, line: int | None = None, column: int | None = None) -> str:
    """The place of an error as ``file:line:column``, as far as it is known."""
    return ":".join(str(part) for part in (path, line, column) if part is not None)


class InsideError(ValueError):
    """What a validator of a whole value finds wrong with one key or item of it."""

    def __init__(self, message: str, *path: str | int, of_key: bool = False) -> None:
        """Say what is wrong.

        Parameters
        ----------
        message : what the key or item must be
        path : keys and indices that lead to it from the value
        of_key : whether the last key itself is wrong, and not what stands under it
        """
        super().__init__(message)
        self.path = path
        self.of_key = of_key
