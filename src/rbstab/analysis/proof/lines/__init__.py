"""Lengths of lines, square roots of trigonometric polynomials, as parts of a reduced energy."""
