"""Rest states among all rotations, of bodies whose energy depends on the rotation alone."""
