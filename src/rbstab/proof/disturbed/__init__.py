"""Proofs that bounded disturbances keep a body near its rest state for ever."""
