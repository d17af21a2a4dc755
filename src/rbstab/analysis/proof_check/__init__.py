"""A checker of proofs that shares no code with the prover. It imports python-flint alone."""
