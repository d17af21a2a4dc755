"""The text of configs in YAML, and the other files that they name."""
