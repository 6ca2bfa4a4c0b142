"""Rig files into tests: which files, their format and dialect, units, channels, and what is refused."""
