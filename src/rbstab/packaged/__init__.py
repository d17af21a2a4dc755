"""Configs and plans that come with the program, to begin with."""
