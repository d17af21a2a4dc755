"""A set of states: a polynomial in z for |z_i| <= 1, and a parallelepiped about each point."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.motion_proof.linear_flow import frames_of
from rbstab.analysis.motion_proof.rounding import rounded_up
from rbstab.analysis.motion_proof.sets.models import UNIT, Model, Program, evaluated
from rbstab.analysis.motion_proof.sets.monomials import Monomials
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA


@dataclass(frozen=True, eq=False)
class MotionSet:
    """Sets of states {P(z) + Qw : |z| <= 1, |w| <= ω}, one for each entry of the first axis.

    Args:
        space: The monomials in z.
        polynomial: P, shape (sets, n, monomials), doubles.
        frame: Q, shape (sets, n, n), doubles.
        radius: ω, shape (sets, n).
    """

    space: Monomials
    polynomial: Array
    frame: Array
    radius: Array

    def __len__(self) -> int:
        return len(self.polynomial)

    def __getitem__(self, chosen: Array | slice) -> "MotionSet":
        """Return some of the sets."""
        parts = (self.polynomial[chosen], self.frame[chosen], self.radius[chosen])
        return MotionSet(self.space, *parts)

    def replaced(self, where: Array, other: "MotionSet") -> "MotionSet":
        """Return the sets, with those of another where `where` is set, shape (sets,)."""
        chosen = where[:, np.newaxis, np.newaxis]
        return MotionSet(
            self.space,
            np.where(chosen, other.polynomial, self.polynomial),
            np.where(chosen, other.frame, self.frame),
            np.where(where[:, np.newaxis], other.radius, self.radius),
        )

    @property
    def error(self) -> Array:
        """A bound on |Qw| by state, shape (sets, n)."""
        bound: Array = rounded_up(np.abs(self.frame) @ self.radius[..., np.newaxis])[..., 0]
        return bound

    @property
    def models(self) -> list[Model]:
        """The states as models without τ, with |Qw| in the remainders."""
        error = self.error
        return [
            Model(self.space, self.polynomial[:, i, :, np.newaxis], error[:, i, np.newaxis])
            for i in range(self.polynomial.shape[1])
        ]

    def halves(self, variable: int) -> "tuple[MotionSet, MotionSet]":
        """Return the two halves of each set, z_i < 0 and z_i > 0, each with |z_i| <= 1 again.

        Args:
            variable: i.
        """
        lower, upper = (self._half(self.space.half(variable, side)) for side in (-1, 1))
        return lower, upper

    def _half(self, substitution: Array) -> "MotionSet":
        polynomial = self.polynomial @ substitution.T
        size = np.abs(self.polynomial) @ np.abs(substitution).T
        rounding = rounded_up((len(self.space) + 2) * UNIT * size.sum(axis=-1))
        inverse = frames_of(self.frame).inverse_size
        apart = rounded_up(inverse @ rounding[..., np.newaxis])[..., 0]
        return MotionSet(self.space, polynomial, self.frame, rounded_up(self.radius + apart))

    def nonlinearity(self, scale: Array) -> Array:
        """Return the size of all terms of degree 2 or more with each z_i, in scaled states.

        If a set has none, it is the size of all its terms.

        Args:
            scale: The size of each state, shape (n,).

        Returns:
            Shape (sets, variables).
        """
        size = (np.abs(self.polynomial) / scale[:, np.newaxis]).sum(axis=-2)
        curved = np.where(self.space.degrees < 2, 0.0, size)
        chosen = np.where(curved.any(axis=-1, keepdims=True), curved, size)
        found: Array = chosen @ np.array(self.space.exponents).reshape(len(self.space), -1)
        return found

    def bounds(self, program: Program) -> tuple[Array, Array]:
        """Return bounds on a function of the states, each of shape (sets,).

        A bound that is not finite is none.

        Args:
            program: The function, as a program with one result.
        """
        (value,) = evaluated(program, self.models)
        return _bounds(value.polynomial[..., 0], value.remainder[..., 0])

    def angle_bounds(self) -> tuple[Array, Array]:
        """Return the smallest and the largest Θ, each of shape (sets, 3), rounded outwards, rad."""
        return _bounds(self.polynomial[:, THETA], self.error[:, THETA])


def _bounds(polynomial: Array, remainder: Array) -> tuple[Array, Array]:
    """Return bounds on polynomials in z, shape (..., monomials)."""
    spread = rounded_up(np.abs(polynomial[..., 1:]).sum(axis=-1) + remainder)
    middle = np.where(np.isfinite(polynomial[..., 0]), polynomial[..., 0], np.nan)
    return np.nextafter(middle - spread, -np.inf), np.nextafter(middle + spread, np.inf)
