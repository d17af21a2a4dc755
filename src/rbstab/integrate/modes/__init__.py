"""Motions of systems whose elements switch: each switch is found, and ends a step."""
