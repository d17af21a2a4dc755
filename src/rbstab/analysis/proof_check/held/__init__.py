"""Check rest states at which a jump of a force holds the body."""
