"""Validated models, and reading them from YAML, CSV and JSON with the place of every fault."""
