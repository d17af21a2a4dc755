"""Benchmark beside programs that a user could choose instead (`make bench-peers`).

Each peer is a script in this folder. It runs in its own process, by the Python of its own virtual
environment below `.peers`, and does not import rbstab. The package `driver` makes the environments,
sends each peer the same problem, chooses its tolerance, and writes the table.
"""
