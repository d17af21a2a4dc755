"""Integrate the members of a sweep, and compute their outcomes and traces."""
