"""Verify a stored proof by the checker, and compare it with a config."""
