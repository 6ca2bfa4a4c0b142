"""What changed between two states of a damper: motions paired, averaged cycles compared, changes fitted and judged."""
