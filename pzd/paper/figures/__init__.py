"""The twenty figures of the paper, drawn from a run: one file a figure, and an index that says how each was made."""
