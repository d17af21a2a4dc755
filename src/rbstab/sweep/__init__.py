"""From a plan to its members: many runs of one config with some of its values varied."""
