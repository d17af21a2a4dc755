"""Commands that write a text to start from, and compute nothing."""
