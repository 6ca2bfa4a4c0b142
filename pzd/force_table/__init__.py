"""Force over temperature, voltage and velocity at steady slip, and its inverse."""
