"""Polynomials in z, exactly: their values, and the places of exact states in a set of states.

The sets are sets of one.
"""

import numpy as np
from flint import arb, ctx

BITS = 220


def value_at(space, coefficients, z):
    """Return Σ c_α z^α as a ball of `BITS` bits, without the program's own arithmetic."""
    with ctx.workprec(BITS):
        total = arb(0)
        for exponents, coefficient in zip(space.exponents, coefficients, strict=True):
            term = arb(coefficient)
            for power, x in zip(exponents, z, strict=True):
                term = term * arb(x) ** power
            total = total + term
        return total


def state_of(states, z, w):
    """Return P(z) + Qw of a set as exact balls."""
    (polynomial,), (frame,) = states.polynomial.tolist(), states.frame.tolist()
    with ctx.workprec(BITS):
        balls = [
            value_at(states.space, row, z)
            + sum((arb(q) * arb(x) for q, x in zip(line, w, strict=True)), arb(0))
            for row, line in zip(polynomial, frame, strict=True)
        ]
        return np.array([ball.mid() for ball in balls], dtype=object)


def place_in_frame(states, z, y):
    """Return Q⁻¹(y - P(z)) of an exact state; the difference is exact, the rest in doubles."""
    (polynomial,), (frame,) = states.polynomial.tolist(), states.frame
    with ctx.workprec(BITS):
        apart = [
            float(entry - value_at(states.space, row, z))
            for entry, row in zip(y, polynomial, strict=True)
        ]
    return np.linalg.solve(frame, np.array(apart))
