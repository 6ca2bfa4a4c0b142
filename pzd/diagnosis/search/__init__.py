"""The search for what is missing: candidates, acceptance, forward selection."""
