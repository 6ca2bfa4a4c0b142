"""Identification: Bingham parameters of every condition with intervals and status, knee law, characteristics."""
