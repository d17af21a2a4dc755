"""The linearised system at a rest state: eigenvalues, modes, frequencies and damping ratios."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

STATES = ("orientation", "angular_velocity", "position", "velocity", "connector_state")
"""What the states are, three by three, in the coordinates in which a system is linearised."""


@dataclass(frozen=True, eq=False)
class Linearisation:
    """ẏ = A (y - y*) near a rest state y*, with the slowest mode first.

    Args:
        matrix: A, shape (n, n).
        eigenvalues: λ, shape (n,), complex, 1/s: real parts descending, and of a conjugate pair the
            one with the positive imaginary part first.
        modes: The eigenvectors as columns, shape (n, n), complex, in the states' units; the entry
            of each that is largest is 1.
        states: The name of each state, shape (n,), such as `orientation[0]`.
    """

    matrix: Array
    eigenvalues: Array
    modes: Array
    states: tuple[str, ...]

    @property
    def natural_frequencies(self) -> Array:
        """|λ|, shape (n,), rad/s."""
        return np.abs(self.eigenvalues)

    @property
    def damping_ratios(self) -> Array:
        """ζ = -Re λ / |λ|, shape (n,): 1 where a mode does not oscillate, < 0 where it grows.

        NaN where λ = 0.
        """
        with np.errstate(invalid="ignore"):
            return -self.eigenvalues.real / np.abs(self.eigenvalues)

    @property
    def time_constants(self) -> Array:
        """τ = -1 / Re λ, shape (n,), s: infinite where a mode does not decay."""
        decay = -self.eigenvalues.real
        with np.errstate(divide="ignore"):
            return np.where(decay > 0, 1.0 / np.where(decay > 0, decay, 1.0), np.inf)

    @property
    def growing(self) -> int:
        """The number of eigenvalues with a positive real part: 0 for a stable rest state."""
        return int((self.eigenvalues.real > 0).sum())


def linearise(system: System, rest: Motion, own: Array) -> Linearisation:
    """The linearisation at a rest state, by complex steps and so exact to round-off.

    Args:
        system: The system, in any coordinates.
        rest: The motion at rest.
        own: The elements' own states there.
    """
    still = configurations(system).system
    A = jacobian(still.rates, still.start(rest, own))
    eigenvalues, modes = np.linalg.eig(A)
    order = np.lexsort((-eigenvalues.imag, -eigenvalues.real.round(9)))
    modes = modes[:, order]
    largest = modes[np.abs(modes).argmax(axis=0), np.arange(len(A))]
    body = STATES[:2] if still.coordinates.holds_contact else STATES[:4]
    names = [*body, *(STATES[4:] if len(own) else ())]
    states = tuple(f"{name}[{axis}]" for name in names for axis in range(3))
    return Linearisation(A, eigenvalues[order], modes / largest, states)
