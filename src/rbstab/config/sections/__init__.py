"""Sections of a config: one model for each, without those of the controller and the elements."""
