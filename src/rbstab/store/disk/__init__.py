"""Bytes on the disk: atomic writing, locks, seals, and careful reading."""
