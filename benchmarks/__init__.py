"""Benchmarks: ratios of things measured side by side in one run, never times against a wish."""
