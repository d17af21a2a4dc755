"""Helpers shared by the tests: systems, configs, made up runs and sweeps, independent oracles."""
