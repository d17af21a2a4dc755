"""Switching of elements: what follows each event, on both engines."""
