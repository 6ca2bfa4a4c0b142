"""The damper: the paper's Bingham element and the effects around it."""
