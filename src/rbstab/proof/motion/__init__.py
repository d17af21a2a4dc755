"""Enclosures of exact motions: of one start, of all starts in a set, and through switches."""
