"""One ride: its arrays, equations of motion, integration and loop, and what it comes to."""
