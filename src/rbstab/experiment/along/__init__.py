"""What changes along a number of a config: eigenvalues at rest, and all rest states."""
