"""Formulas of elements of users, as operations: their values, bounds, signs and terms."""
