"""A set of states: a polynomial in z for |z_i| <= 1, and a parallelepiped about each point."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.motion_proof.linear_flow import frame_of
from rbstab.analysis.motion_proof.rounding import rounded_up
from rbstab.analysis.motion_proof.sets.models import UNIT, Model, Program, evaluated
from rbstab.analysis.motion_proof.sets.monomials import Monomials
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA


@dataclass(frozen=True, eq=False)
class MotionSet:
    """A set of states {P(z) + Qw : |z| <= 1, |w| <= ω}.

    Args:
        space: The monomials in z.
        polynomial: P, shape (n, monomials), doubles.
        frame: Q, shape (n, n), doubles.
        radius: ω, shape (n,).
    """

    space: Monomials
    polynomial: Array
    frame: Array
    radius: Array

    @property
    def error(self) -> Array:
        """A bound on |Qw| by state, shape (n,)."""
        bound: Array = rounded_up(np.abs(self.frame) @ self.radius)
        return bound

    @property
    def models(self) -> list[Model]:
        """The states as models without τ, with |Qw| in the remainders."""
        return [
            Model(self.space, row[:, np.newaxis], np.array([error]))
            for row, error in zip(self.polynomial, self.error.tolist(), strict=True)
        ]

    def halves(self, variable: int) -> "tuple[MotionSet, MotionSet]":
        """Return the two halves of the set, z_i < 0 and z_i > 0, each with |z_i| <= 1 again.

        Args:
            variable: i.
        """
        lower, upper = (self._half(self.space.half(variable, side)) for side in (-1, 1))
        return lower, upper

    def _half(self, substitution: Array) -> "MotionSet":
        frame = frame_of(self.frame)
        assert frame is not None, "frames of steps have inverses"
        polynomial = self.polynomial @ substitution.T
        size = np.abs(self.polynomial) @ np.abs(substitution).T
        rounding = rounded_up((len(self.space) + 2) * UNIT * size.sum(axis=1))
        radius = rounded_up(self.radius + frame.inverse_size @ rounding)
        return MotionSet(self.space, polynomial, self.frame, radius)

    def nonlinearity(self, scale: Array) -> Array:
        """Return the size of all terms of degree 2 or more with each z_i, in scaled states.

        If there are none, it is the size of all terms.

        Args:
            scale: The size of each state, shape (n,).
        """
        size = (np.abs(self.polynomial) / scale[:, np.newaxis]).sum(axis=0)
        curved = np.where(self.space.degrees < 2, 0.0, size)
        found: Array = (curved if curved.any() else size) @ np.array(self.space.exponents)
        return found

    def bounds(self, program: Program) -> tuple[float, float]:
        """Return bounds on a function of the states, given as a program with one result.

        Raises:
            TooWide: The function has no model on this set.
        """
        (value,) = evaluated(program, self.models)
        return _bounds(value.polynomial[:, 0], float(value.remainder[0]))

    def angle_bounds(self) -> tuple[Array, Array]:
        """Return the smallest and the largest Θ, rounded outwards, each of shape (3,), rad."""
        rows, errors = self.polynomial[THETA], self.error[THETA]
        pairs = [_bounds(row, error) for row, error in zip(rows, errors.tolist(), strict=True)]
        low, high = np.array(pairs).T
        return low, high


def _bounds(polynomial: Array, remainder: float) -> tuple[float, float]:
    """Return bounds on a polynomial in z."""
    spread = float(rounded_up(np.abs(polynomial[1:]).sum() + remainder))
    middle = float(polynomial[0])
    return float(np.nextafter(middle - spread, -np.inf)), float(
        np.nextafter(middle + spread, np.inf)
    )
