"""Proofs: of the rest states of a body, and of its exact motions."""
