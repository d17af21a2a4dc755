"""Proofs as plain data: what is read, written and stored."""
