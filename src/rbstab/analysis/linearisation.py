"""The linearised system at a rest state: eigenvalues, modes, frequencies and damping ratios."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.configuration import configurations, without_inputs
from rbstab.integrate.in_quaternions import in_quaternions
from rbstab.mechanics import pitch
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.quaternion import rate_matrix
from rbstab.mechanics.states import PITCH, THETA
from rbstab.systems.impact import stop_of
from rbstab.systems.modes import with_modes_at
from rbstab.systems.system import System

BODY_STATES = ("orientation", "angular_velocity", "position", "velocity")
"""The names of the body's vectors in Z; a held body has the first two."""


ROUND_OFF = float(np.sqrt(2 * np.finfo(float).eps))
"""Eigenvalues whose imaginary part is at most this share of their size count as real: the damping
ratio ζ of such a pair is 1 to the last digit. A double real eigenvalue is computed as such a pair,
with an imaginary part that grows as the root of the errors of the matrix."""


@dataclass(frozen=True, eq=False)
class Linearisation:
    """ẏ = A (y - y*) near a rest state y*, with the slowest mode first.

    Args:
        matrix: A, shape (n, n).
        eigenvalues: λ, shape (n,), complex, 1/s, by descending real part. Of a conjugate pair, the
            one with the positive imaginary part comes first.
        modes: The eigenvectors as columns, shape (n, n), complex, in the units of the states. The
            largest entry of each is 1.
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
        """ζ = -Re λ / |λ|, shape (n,): 1 for a mode without oscillation, < 0 for a growing mode.

        NaN where λ = 0.
        """
        with np.errstate(invalid="ignore"):
            return -self.eigenvalues.real / np.abs(self.eigenvalues)

    @property
    def time_constants(self) -> Array:
        """τ = -1 / Re λ, shape (n,), s; infinite for a mode that does not decay."""
        decay = -self.eigenvalues.real
        with np.errstate(divide="ignore"):
            return np.where(decay > 0, 1.0 / np.where(decay > 0, decay, 1.0), np.inf)

    @property
    def growing(self) -> int:
        """The number of eigenvalues with a positive real part: 0 for a stable rest state."""
        return int((self.eigenvalues.real > 0).sum())


NEAR_POLE = 1e-4
"""Where |cos θ2| is smaller, rates of Θ are linearised with large errors."""


class NoDerivativesError(ArithmeticError):
    """The equations have no derivatives at a rest state, as where a spring has no length."""


def are_real(eigenvalues: Array) -> Array:
    """Return for each eigenvalue whether it is real to round-off; booleans of the same shape.

    Whatever oscillates before it decays is not: its imaginary part is a large share of its size.
    """
    return np.asarray(np.abs(eigenvalues.imag) <= ROUND_OFF * np.abs(eigenvalues))


def eigenvalue_text(eigenvalue: complex) -> str:
    """Return an eigenvalue with Im λ ≥ 0 and its conjugate as text: `-2.927 ± 7.506i`.

    A pair that is real to round-off is written as a double eigenvalue.
    """
    real = f"{eigenvalue.real:.4g}"
    if not are_real(np.asarray(eigenvalue)):
        return f"{real} ± {abs(eigenvalue.imag):.4g}i"
    return f"{real} (twice)" if eigenvalue.imag else real


def linearise(system: System, rest: Motion, element_states: Array) -> Linearisation:
    """Linearise a system at a rest state; complex steps make the matrix exact to round-off.

    Args:
        system: The system, in any coordinates. Its inputs are left out. If its elements switch, the
            modes are those of the rest state. If it rests against a stop, θ2 and its rate have the
            eigenvalue 0. At θ2 = ±90° no element may read Θ; the states of the orientation are then
            turns about the axes of the body.
        rest: The motion at rest.
        element_states: The elements' own states there.

    Raises:
        NoDerivativesError: The equations have no derivatives there.
    """
    resting = without_inputs(configurations(system).system)
    start = resting.start(rest, element_states)
    resting = with_modes_at(resting, start)
    at_pole = abs(np.cos(start[PITCH])) < NEAR_POLE
    A = _by_turns(resting, start) if at_pole else jacobian(resting.rates, start)
    if not np.isfinite(A).all():
        raise NoDerivativesError
    eigenvalues, modes = _eigenvalues(A, resting, start)
    order = np.lexsort((-eigenvalues.imag, -eigenvalues.real.round(9)))
    modes = modes[:, order]
    largest = modes[np.abs(modes).argmax(axis=0), np.arange(len(A))]
    body = BODY_STATES[:2] if resting.coordinates.holds_contact else BODY_STATES
    sizes = dict.fromkeys(body, 3) | {
        name: place.stop - place.start for name, place in resting.own_states.items()
    }
    states = tuple(f"{name}[{index}]" for name, size in sizes.items() for index in range(size))
    return Linearisation(A, eigenvalues[order], modes / largest, states)


def _by_turns(system: System, start: Array) -> Array:
    """Return A with turns about the axes of the body in place of Θ, by q̇ = ½ q⊗(0, Ω)."""
    moving, q = in_quaternions(system)
    y, place = q.from_angles(start), system.coordinates.size
    w, r = y[place], y[THETA]
    turn = np.delete(np.eye(len(y)), place, axis=1)
    turn[THETA, THETA], turn[place, THETA] = rate_matrix(w, r), -0.5 * r
    return np.asarray(np.linalg.pinv(turn) @ jacobian(moving.rates, y) @ turn)


def _eigenvalues(A: Array, system: System, start: Array) -> tuple[Array, Array]:
    """Return the eigenvalues and eigenvectors of A at a rest state."""
    stop = stop_of(system)
    if stop is None or not stop.mode.any():
        eigenvalues, modes = np.linalg.eig(A)
        return eigenvalues, modes
    # A body that rests against a stop keeps θ2. All other motions lie in the space in which θ2 and
    # its rate do not change. Without this reduction a zero would be as large as the root of the
    # round-off, and seem to grow.
    held = [np.eye(len(A))[PITCH], jacobian(lambda y: pitch.rate(system.motion(y)), start)]
    _, _, axes = np.linalg.svd(np.array(held))
    moving = axes[2:].T
    eigenvalues, modes = np.linalg.eig(moving.T @ A @ moving)
    return np.concatenate([eigenvalues, [0.0, 0.0]]), np.hstack([moving @ modes, axes[:2].T])
