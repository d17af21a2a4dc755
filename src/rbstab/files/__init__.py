"""Opening files that users name, for configs and for results."""
