"""The noise of a record, and what may differ between tests without being an effect."""
