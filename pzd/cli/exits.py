"""The exit codes that are not errors of the user; those stand with their errors."""

from __future__ import annotations

DONE = 0
OWN_FAULT = 1
UNTRUSTED = 4
INTERRUPTED = 130
