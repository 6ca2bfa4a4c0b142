"""Runs the command line as ``python -m pzd``."""

from __future__ import annotations

from pzd.cli import main

main()
