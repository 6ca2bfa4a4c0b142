"""Sections of the page, with their sentences and the tables that no command prints."""
