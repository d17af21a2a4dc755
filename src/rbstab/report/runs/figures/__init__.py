"""Figures of runs, drawn from their stored arrays."""
