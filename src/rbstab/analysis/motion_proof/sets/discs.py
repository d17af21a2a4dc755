"""Bounds on functions of complex variables: real numbers with complex discs around them.

The disc of a number has all complex numbers within a radius. Sums, products, inverses, sines and
cosines of such discs lie in discs around real numbers again. Arrays may have any shape.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rbstab.analysis.motion_proof.rounding import rounded_up
from rbstab.analysis.motion_proof.sets.graph import INVERSE, PRODUCT, SINE, VARIABLE
from rbstab.analysis.motion_proof.sets.models import UNIT, ConstantFactors, Program
from rbstab.analysis.proof.trigonometric import rigorous_basis
from rbstab.mechanics.numbers import Array

SERIES_TERMS = 40
"""Terms of the series of cosh and sinh."""

LARGEST_RADIUS = 8.0
"""The largest radius of an angle; there the terms that are left out are below the last one."""


class Discs(NamedTuple):
    """All complex numbers within `radius` of `centre`; a radius that is not finite is no bound."""

    centre: Array
    radius: Array

    @property
    def bound(self) -> Array:
        """A bound on their absolute values."""
        found: Array = rounded_up(np.abs(self.centre) + self.radius)
        return found


def discs_of(program: Program, variables: list[Discs]) -> list[Discs]:
    """Return discs of a program's forms.

    Args:
        program: The program.
        variables: The discs of the graph's variables.
    """
    known: dict[int, Discs] = {}
    value = _forms(known)
    with np.errstate(all="ignore"):
        for node, kind, operands in program.steps:
            if kind == VARIABLE:
                known[node] = variables[node]
            elif kind == PRODUCT:
                known[node] = _product(value(operands[0]), value(operands[1]))
            elif kind == INVERSE:
                known[node] = _inverse(value(operands[0]))
            else:
                known[node] = _of_angle(value(operands[0]), sine=kind == SINE)
        zero = np.zeros_like(variables[0].centre)
        found = (value(form) for form in program.results)
        return [Discs(zero + one.centre, zero + one.radius) for one in found]


def _forms(known: dict[int, Discs]) -> Callable[[ConstantFactors], Discs]:
    def value(form: ConstantFactors) -> Discs:
        if form.is_node:
            return known[form.nodes[0]]
        centre: Array = np.asarray(form.constant)
        radius, size = np.asarray(form.constant_radius), np.abs(centre)
        for node, factor, error in zip(form.nodes, form.factors, form.radii, strict=True):
            one = known[node]
            centre = centre + factor * one.centre
            radius = radius + abs(factor) * one.radius + error * one.bound
            size = size + abs(factor) * np.abs(one.centre)
        rounding = (len(form.nodes) + 3) * UNIT * size
        return Discs(centre, rounded_up(radius + rounding))

    return value


def _product(a: Discs, b: Discs) -> Discs:
    centre = a.centre * b.centre
    radius = np.abs(a.centre) * b.radius + a.radius * b.bound + 2 * UNIT * np.abs(centre)
    return Discs(centre, rounded_up(radius))


def _inverse(x: Discs) -> Discs:
    """|1/(c + δ) - 1/c| = |δ|/(|c||c + δ|)."""
    centre, size = 1.0 / x.centre, np.abs(x.centre)
    least = np.nextafter(size - x.radius, 0.0)
    # Not over the product of both: where that overflows, the quotient would be zero.
    radius = rounded_up(x.radius / size / least) + 2 * UNIT * np.abs(centre)
    usable = (least > 0.0) & np.isfinite(x.centre)
    return Discs(centre, np.where(usable, rounded_up(radius), np.inf))


def _of_angle(x: Discs, *, sine: bool) -> Discs:
    """sin(c + δ) = sin c cos δ + cos c sin δ, |cos δ - 1| <= cosh r - 1, |sin δ| <= sinh r."""
    finite = np.isfinite(x.centre)
    basis = rigorous_basis(np.where(finite, x.centre, 0.0), 1)
    c, s = (np.where(finite, basis[..., k], np.nan) for k in (1, 2))
    own, other = (s, c) if sine else (c, s)
    even, odd = _hyperbolic(x.radius)
    radius = (np.abs(own) + UNIT) * even + (np.abs(other) + UNIT) * odd + 2 * UNIT
    return Discs(own, rounded_up(radius))


def _hyperbolic(r: Array) -> tuple[Array, Array]:
    """Return upper bounds on cosh r - 1 and sinh r."""
    term, even, odd = np.ones_like(r), np.zeros_like(r), np.zeros_like(r)
    for k in range(1, SERIES_TERMS + 1):
        term = term * r / k
        if k % 2:
            odd = odd + term
        else:
            even = even + term
    inside = r <= LARGEST_RADIUS
    rest = rounded_up(term)
    return (
        np.where(inside, rounded_up(even + rest), np.inf),
        np.where(inside, rounded_up(odd + rest), np.inf),
    )
