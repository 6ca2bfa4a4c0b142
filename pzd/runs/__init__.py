"""How runs/ is laid out and written; nothing else knows."""

from __future__ import annotations

from pzd.runs.disk import file_hash
from pzd.runs.folder import CONFIG, Kept, Run

__all__ = ["CONFIG", "Kept", "Run", "file_hash"]
