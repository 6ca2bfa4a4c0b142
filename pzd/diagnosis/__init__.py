"""Where simulation and measurement disagree above the noise."""
