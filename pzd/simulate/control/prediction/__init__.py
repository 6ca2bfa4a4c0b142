"""The predictive controller: its memory, its plant, its forecast of the road, and its choice of voltages."""
