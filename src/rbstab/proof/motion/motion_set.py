"""A set of states: a polynomial in z for |z_i| <= 1, and a parallelepiped about each point."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA
from rbstab.proof.exact.expr import Expr
from rbstab.proof.motion.linear_flow import frames_of
from rbstab.proof.motion.models import Models, evaluated
from rbstab.proof.motion.monomials import Monomials, monomials_up_to
from rbstab.proof.motion.program import programs
from rbstab.proof.motion.rounding import rounded_up

POINT = monomials_up_to(0, 0)
"""The monomials of a set about a single start."""


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
    def models(self) -> Models:
        """The states as models without τ, with |Qw| in the remainders."""
        polynomial = np.ascontiguousarray(self.polynomial.swapaxes(0, 1))
        return Models(self.space, polynomial[np.newaxis], np.ascontiguousarray(self.error.T))

    def upright(self, scale: Array) -> "MotionSet":
        """Return the sets in a frame along the axes: larger sets."""
        frame = np.broadcast_to(np.diag(scale), self.frame.shape)
        return MotionSet(self.space, self.polynomial, frame, rounded_up(self.error / scale))

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
        by_variable: Array = chosen @ np.array(self.space.exponents).reshape(len(self.space), -1)
        return by_variable

    def angle_bounds(self) -> tuple[Array, Array]:
        """Return the smallest and the largest Θ, each of shape (sets, 3), rounded outwards, rad."""
        low, high = self.models[THETA].range()
        return low.T, high.T


def set_of(states: Sequence[Expr], space: Monomials, scale: Array) -> MotionSet | None:
    """Return the set of all states that are expressions of z, as the only one.

    Args:
        states: The states; the variable i is z_i.
        space: The monomials in z.
        scale: The size of each state, shape (n,).

    Returns:
        The set; None if it has no bounds.
    """
    variables = np.zeros((1, max(space.variables, 1), 1, len(space)))
    variables[0, : space.variables, 0, 1 : space.variables + 1] = np.eye(space.variables)
    (of_z,) = programs(variables.shape[1], states)
    models = evaluated(of_z, Models(space, variables, np.zeros(variables.shape[1:3])))
    frame = np.diag(scale)[np.newaxis]
    with np.errstate(all="ignore"):
        radius = rounded_up(models.remainder.T / scale)
        states_of_z = MotionSet(space, models.polynomial[0].swapaxes(0, 1), frame, radius)
        usable = np.isfinite(frames_of(frame).error).all() and np.isfinite(states_of_z.error).all()
    return states_of_z if usable else None


def point_sets(values: Array, errors: Array, scale: Array) -> MotionSet:
    """Return sets about single states.

    Args:
        values: Shape (sets, n).
        errors: Bounds on their distances from the exact states, in the same shape.
        scale: The size of each state, shape (n,).
    """
    frame = np.broadcast_to(np.diag(scale), (len(values), len(scale), len(scale)))
    return MotionSet(POINT, values[..., np.newaxis], frame, rounded_up(errors / scale))
