"""From a problem to a trajectory: one interface, two engines, named statuses."""
