"""Separate the lengths of lines from an exact energy: U = p(Θ) + Σ w_j √s_j(Θ)."""

from dataclasses import replace
from fractions import Fraction

import numpy as np

from rbstab.analysis.proof.lines.line import Line
from rbstab.analysis.proof.lines.shortest import line_of
from rbstab.analysis.proof.multiple_angles import NotTrigonometric, form_of
from rbstab.analysis.proof.polynomial import Polynomial, fraction
from rbstab.analysis.proof.trigonometric import TrigonometricForm

MOST_ENTRIES = 3
"""The entries of t = [1, cos θ, sin θ] in the square of a length: it is linear in A, as lemma 7
demands."""


def separated_lines(energy: Polynomial) -> tuple[Polynomial, tuple[Line, ...]]:
    """Return an energy without its lengths, and the lines whose lengths it has.

    Each line in the ring must have a
    length at each attitude, also one of weight 0 (a spring without a rest length): its force has
    the direction of the line.

    Raises:
        NotTrigonometric: A length is multiplied by another one, or by a function of Θ, or its
            square has a multiple of an angle.
        NoLength: A line may have no length.
    """
    ring = energy.ring
    plain, weights = lengths_apart(energy)
    squares = [trimmed(form_of(square)) for square in ring.squares]
    pairs = zip(weights, squares, strict=True)
    return plain, tuple(line_of(float(weight), square) for weight, square in pairs)


def lengths_apart(energy: Polynomial) -> tuple[Polynomial, list[Fraction]]:
    """Return an energy without its lengths, and the factor of each of them.

    Even powers of a length are replaced by those of its square.

    Raises:
        NotTrigonometric: A length is multiplied by another one, or by a variable.
    """
    ring = energy.ring
    plain = ring.constant(0)
    weights = [Fraction(0)] * len(ring.squares)
    for powers, coefficient in energy.terms():
        lengths = ring.split(powers).roots
        without = (*powers[: len(powers) - ring.roots], *[0] * ring.roots)
        term = Polynomial(ring, ring.context.from_dict({without: coefficient}))
        for place, power in enumerate(lengths):
            for _ in range(power // 2):
                term = term * ring.squares[place]
        odd = [place for place, power in enumerate(lengths) if power % 2]
        if not odd:
            plain = plain + term
        elif len(odd) > 1 or term.constant_value is None:
            raise NotTrigonometric
        else:
            weights[odd[0]] += fraction(term.constant_value)
    return plain, weights


def trimmed(form: TrigonometricForm) -> TrigonometricForm:
    """Return a form without the multiples of angles that have no term, such as those of s² + c²."""
    size = len(form.coefficients)
    while size > 1:
        inner = form.coefficients[: size - 2, : size - 2, : size - 2]
        if np.count_nonzero(inner) < np.count_nonzero(form.coefficients):
            break
        size -= 2
    if size > MOST_ENTRIES:
        raise NotTrigonometric
    return replace(form, coefficients=form.coefficients[:size, :size, :size])
