"""Proved bounds on an energy over many boxes, in doubles rounded outwards."""
