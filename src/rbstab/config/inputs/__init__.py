"""Inputs in the config schema: their signals, and the files of their tables."""
