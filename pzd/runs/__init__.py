"""How runs/ is laid out and written; nothing else knows."""

from __future__ import annotations

from pzd.runs.disk import file_hash, versions
from pzd.runs.folder import CONFIG, Run, StageFolder

__all__ = ["CONFIG", "Run", "StageFolder", "file_hash", "versions"]
