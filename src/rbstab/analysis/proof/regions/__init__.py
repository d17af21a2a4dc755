"""The region of each minimum: the component of {U < c} about it, with the gates that bound it."""
