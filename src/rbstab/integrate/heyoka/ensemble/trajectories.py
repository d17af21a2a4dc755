"""The results of an ensemble: the trajectories of its members, and what is observed along them."""

from collections.abc import Sequence
from typing import NamedTuple

from rbstab.mechanics.numbers import Array


class EnsembleTrajectories(NamedTuple):
    """Trajectories of m members at n samples.

    The states at the samples of the ensemble are valid until it runs again. Their memory is reused,
    because allocating it costs as much as evaluating the states.

    Attributes:
        lanes: The states, shape (states, lanes, n). The lanes after the last member fill its batch.
        lyapunov_change: ∫v' dt, shape (m, n), J.
        steps: Accepted steps, shape (m,).
        done: Whether a member reached the last sample, shape (m,). The values of a member that did
            not are meaningless.
        ends: The times and the audited states at the ends of the steps of each member, shape (1 +
            states, ends), the latter as the integrator scales them.
        scales: The scales of their audit states, shape (m,), J.
        supplied_energy: ∫supplied dt, shape (m, n), J; None if no element supplies power.
        angles: Where `ends` has quaternions, Θ there, with θ1 and θ3 continued, shape (3, ends),
            rad; else nothing.
    """

    lanes: Array
    lyapunov_change: Array
    steps: Array
    done: Array
    ends: list[Array]
    scales: Array
    supplied_energy: Array | None = None
    angles: Sequence[Array] = ()

    @property
    def states(self) -> Array:
        """The states in the system's coordinates, shape (states, m, n)."""
        return self.lanes[:, : len(self.steps)]


class ObservedTrajectories(NamedTuple):
    """The observed quantities of m members at n samples.

    Attributes:
        values: E and Θ, shape (6, m, n), m, inertial, and rad.
        rates: F = Ė and Θ̇ = BΩ, shape (6, m, n), m/s, inertial, and rad/s.
        energy: The sum of all energies, shape (m, n), J.
    """

    values: Array
    rates: Array
    energy: Array

    @property
    def E(self) -> Array:
        """E, shape (3, m, n), m, inertial."""
        return self.values[:3]

    @property
    def F(self) -> Array:
        """F, shape (3, m, n), m/s, inertial."""
        return self.rates[:3]

    @property
    def Theta_rate(self) -> Array:
        """Θ̇ = BΩ, shape (3, m, n), rad/s."""
        return self.rates[3:]


class ObservedPositions(NamedTuple):
    """X, m, and V, m/s, of m members at n samples, shape (3, m, n) each, inertial."""

    X: Array
    V: Array
