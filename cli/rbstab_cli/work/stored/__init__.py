"""Commands that read stored results, and compute nothing."""
