"""Human vibration: frequency weighting, measures, and their assessment by three standards."""
