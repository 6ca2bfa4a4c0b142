"""How runs/ is laid out and written; nothing else knows."""

from __future__ import annotations

from pzd.runs.disk import file_hash, versions
from pzd.runs.folder import CONFIG, StageFolder, Run

__all__ = ["CONFIG", "StageFolder", "Run", "file_hash", "versions"]
