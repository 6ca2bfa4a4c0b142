"""The names of records and files."""

from __future__ import annotations

import re


def safe_name(text: str) -> str:
    """A text as a name that every file system takes: all but letters, digits, `.`, `_` and `-` becomes `_`."""
    return re.sub(r"[^A-Za-z0-9._-]", "_", text)
