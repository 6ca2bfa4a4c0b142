"""The half-car: its equations and modes, and suspension, tyre and road under it."""
