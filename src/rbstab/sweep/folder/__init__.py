"""The folder of a sweep: manifest, locks, shards, traces, and the file that gathers them."""
