"""Report sections on a sweep; `sections` puts them together."""
