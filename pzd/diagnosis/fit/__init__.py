"""Dampers fitted to records: likelihood, parameters, least squares, intervals."""
