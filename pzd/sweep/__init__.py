"""The same run many times: every combination of values, and random draws, on one machine or a cluster."""
