"""Rigorous proofs: all rest states in the range, and the region of proved convergence."""
