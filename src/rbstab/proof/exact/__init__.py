"""Exact expressions, how they are rewritten, and lengths in them."""
