"""Stability analysis of a system and of its motions."""
