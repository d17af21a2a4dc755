"""The region of each minimum: the component of {U < level} about it."""
