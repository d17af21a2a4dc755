"""Sensitivities of a run's outcome, and the tuning of gains."""
