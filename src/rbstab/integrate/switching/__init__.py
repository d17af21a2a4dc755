"""Switching: drivers that integrate a sliding connector through its modes."""
