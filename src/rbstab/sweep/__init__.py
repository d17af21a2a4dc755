"""Sweeps: many runs of one config, with some of its values varied as a plan describes."""
