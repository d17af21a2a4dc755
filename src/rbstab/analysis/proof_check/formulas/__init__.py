"""Formulas of elements of users as parts of a reduced energy, in balls."""
