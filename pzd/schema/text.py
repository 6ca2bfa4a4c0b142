"""Reads the text of a file, and says in one line why it cannot."""

from __future__ import annotations

from pathlib import Path

from pzd.schema.errors import FilesError, UserError, at


def read_text(path: Path, missing: type[UserError], advice: str) -> str:
    """The text of a UTF-8 file, without a byte order mark.

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
