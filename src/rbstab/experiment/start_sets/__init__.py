"""Proofs of convergence for all starts within tolerances."""
