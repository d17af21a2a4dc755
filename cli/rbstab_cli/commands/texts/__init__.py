"""Commands that print a text for other programs, and compute nothing."""
