"""What is left of the force where the verdict is `unexplained`, told as a shape that it has: a hypothesis, no name."""
