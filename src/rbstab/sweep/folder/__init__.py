"""The folder of a sweep: its manifest, locks, shards, traces, and the file of all shards."""
