"""Hides effects in virtual rigs, and scores what the diagnosis names: how far its word can be trusted."""
