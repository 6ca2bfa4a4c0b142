"""The command line: no physics and no file formats, only commands, what they print and how they exit."""

from __future__ import annotations

from pzd.cli.app import main

__all__ = ["main"]
