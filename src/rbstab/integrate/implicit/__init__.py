"""The implicit law of a sliding connector: fixed steps, which have no events."""
