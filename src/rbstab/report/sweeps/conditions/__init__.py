"""Conditions of a sweep, variants or chosen values, compared: which is better, and how surely."""
