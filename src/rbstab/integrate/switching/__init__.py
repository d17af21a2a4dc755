"""Drivers: they integrate a system with a sliding connector from mode to mode."""
