"""Sensitivities of the outcome of a run, and tuning of gains."""
