"""All rides of a config: which they are, searches for the best value, responses, and all in one artefact."""
