"""Human vibration: frequency weighting, measures, and what three standards make of them."""
