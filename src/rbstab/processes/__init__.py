"""Worker processes and processors: what sweeps and reports share."""
