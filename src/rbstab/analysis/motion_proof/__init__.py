"""Motions proved: an enclosure of the exact motion, and the convergence that follows from it."""
