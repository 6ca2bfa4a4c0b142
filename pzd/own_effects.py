"""A user's own effect files: in the folder that the environment variable PZD_EFFECTS names.

A file there counts as one in `pzd/damper/effects/`: found, checked, compiled, and part of what a stage depends on.
"""

from __future__ import annotations

import os
from pathlib import Path

VARIABLE = "PZD_EFFECTS"
"""The environment variable; workers on this machine have it from the command, those of a cluster need their own."""


def own_folder() -> Path | None:
    """Return the folder of the user's effect files; None where the variable is not set."""
    given = os.environ.get(VARIABLE)
    return Path(given).absolute() if given else None


def own_files() -> list[Path]:
    """Return the user's effect files."""
    folder = own_folder()
    return [] if folder is None else sorted(folder.glob("*.py"))
