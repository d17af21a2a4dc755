"""Integration of a problem: one interface, two engines, named statuses."""
