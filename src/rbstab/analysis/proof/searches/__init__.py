"""Searches for rest states, by themselves and as the start of proofs."""
