"""Stored results -> tables, figures and pages."""
