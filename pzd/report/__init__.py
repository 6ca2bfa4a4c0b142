"""The comfort of every ride, and one page on the whole run."""
