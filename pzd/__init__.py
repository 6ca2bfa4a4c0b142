"""What a controlled damper's rig files say, what the model misses, and what the passengers feel."""
