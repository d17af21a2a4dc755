"""Proofs of all motions from a set of initial states: Taylor models in the initial state."""
