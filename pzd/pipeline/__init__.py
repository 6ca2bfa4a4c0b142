"""The stages in order, which of them are stale and why."""
