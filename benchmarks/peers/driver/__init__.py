"""The driver: environments, the problem, the choice of tolerances, timing, and the table."""
