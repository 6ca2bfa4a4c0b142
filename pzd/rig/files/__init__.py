"""Rig files into records: listing, format and dialect, layout, units, channels, refusals; and the guess of a config."""
