"""Claims about all bodies in a box of tolerances."""
