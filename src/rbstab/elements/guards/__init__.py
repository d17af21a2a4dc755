"""Guards of the range of the Euler angles (eq. 5): what keeps θ2 inside."""
