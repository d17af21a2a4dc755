"""Plans of sweeps: read, check and write plans, and compute the values of their members."""
