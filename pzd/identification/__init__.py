"""Identification: the Bingham parameters of every condition, with intervals and their trust."""
