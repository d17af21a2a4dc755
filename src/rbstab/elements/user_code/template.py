"""The template of an element of a user, as `rbstab init --element` writes it."""

from pathlib import Path

TEMPLATE = (Path(__file__).parent / "template.py.txt").read_text(encoding="utf-8")
"""The text of a file with one element that works."""
