"""The linear part of a step: polynomials near the fundamental matrix, and bounds on what they miss.

Along the polynomial p of a step of length h, with J = ∂f/∂y and τ = t/h, small differences follow
e' = hJe. Φ and Ψ are polynomials in τ with matrices of doubles as coefficients: Φ is near the
fundamental matrix, Ψ near its inverse. They are exact as they are; only their defects are bounded.
"""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.motion_proof.rounding import (
    error_of_inverse,
    error_of_products,
    rounded_up,
)
from rbstab.analysis.motion_proof.taylor import JacobianSeries
from rbstab.mechanics.numbers import Array


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame Q, with a computed inverse and a bound on its error, each of shape (n, n)."""

    matrix: Array
    inverse: Array
    error: Array

    @property
    def inverse_size(self) -> Array:
        """A bound on |Q⁻¹|."""
        return np.abs(self.inverse) + self.error


def frame_of(matrix: Array) -> Frame | None:
    """Return a frame; None if it is not proved that the matrix has an inverse."""
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return None
    error = error_of_inverse(matrix, inverse)
    return None if error is None else Frame(matrix, inverse, error)


@dataclass(frozen=True, eq=False)
class LinearFlow:
    """Φ and Ψ of a step of h seconds: the coefficients of τᵏ, shape (degree + 1, n, n)."""

    h: float
    J: JacobianSeries
    forward: Array
    backward: Array

    @property
    def forward_at_end(self) -> tuple[Array, Array]:
        """Φ(1), and a bound on its rounding error."""
        magnitude = np.abs(self.forward).sum(axis=0)
        return self.forward.sum(axis=0), error_of_products(magnitude)

    def last_term(self, scale: Array) -> float:
        """Return the norm of the last term of Φ, in scaled states; infinite if it has none."""
        term = self.forward[-1] / scale[:, np.newaxis] * scale
        return float(np.linalg.norm(term, 2)) if np.isfinite(term).all() else np.inf


def linear_flow(J: JacobianSeries, h: float) -> LinearFlow:
    """Return polynomials near the solutions of Φ' = hJΦ and Ψ' = -hΨJ from the identity."""
    terms, n, _ = J.middle.shape
    forward, backward = [np.eye(n)], [np.eye(n)]
    for k in range(terms):
        growth = sum(J.middle[j] @ forward[k - j] for j in range(k + 1))
        decay = sum(backward[k - j] @ J.middle[j] for j in range(k + 1))
        forward.append(h / (k + 1) * growth)
        backward.append(-h / (k + 1) * decay)
    return LinearFlow(h, J, np.array(forward), np.array(backward))


@dataclass(frozen=True, eq=False)
class LinearBounds:
    """Bounds for 0 <= τ <= 1, each of shape (n, n).

    Attributes:
        residual: On |Q⁻¹ ∫(Ψ' + hΨJ)|.
        backward: On |Q⁻¹Ψ|.
        forward: On |ΦQ|.
        mismatch: On |I - ΦΨ|.
    """

    residual: Array
    backward: Array
    forward: Array
    mismatch: Array


def linear_bounds(flow: LinearFlow, frame: Frame) -> LinearBounds:
    """Return the bounds of a flow in a frame."""
    Phi, Psi = flow.forward, flow.backward
    Phi_size, Psi_size, Q_size = np.abs(Phi), np.abs(Psi), np.abs(frame.matrix)
    directed = np.abs(frame.inverse @ Psi)
    directed = directed + error_of_products(np.abs(frame.inverse) @ Psi_size)
    forward = np.abs(Phi @ frame.matrix) + error_of_products(Phi_size @ Q_size)
    product, size = _product(Phi, Psi), _product(Phi_size, Psi_size)
    identity = np.eye(len(Q_size))
    product[0] -= identity
    size[0] += identity
    mismatch = np.abs(product) + error_of_products(size)
    return LinearBounds(
        residual=rounded_up(frame.inverse_size @ _residual(flow)),
        backward=rounded_up(directed.sum(axis=0) + frame.error @ Psi_size.sum(axis=0)),
        forward=rounded_up(forward.sum(axis=0)),
        mismatch=rounded_up(mismatch.sum(axis=0)),
    )


def _residual(flow: LinearFlow) -> Array:
    """Bound |∫(Ψ' + hΨJ)| over 0 to τ, for 0 <= τ <= 1, shape (n, n)."""
    Psi, J, h = flow.backward, flow.J, flow.h
    terms, Psi_size = len(J.middle), np.abs(Psi)
    coefficients, size = h * _product(Psi, J.middle), h * _product(Psi_size, np.abs(J.middle))
    derivative = Psi[1:] * np.arange(1, len(Psi))[:, np.newaxis, np.newaxis]
    coefficients[:terms] += derivative
    size[:terms] += np.abs(derivative)
    bound = np.abs(coefficients) + error_of_products(size)
    # The integral of τᵏ is at most 1/(k + 1).
    bound = (bound / np.arange(1, len(bound) + 1)[:, np.newaxis, np.newaxis]).sum(axis=0)
    # What is not in `middle`: the errors of the coefficients, and all further terms.
    missing = h * Psi_size.sum(axis=0) @ (J.radius.sum(axis=0) + J.rest)
    residual: Array = rounded_up(bound + missing)
    return residual


def _product(first: Array, second: Array) -> Array:
    """Multiply two polynomials whose coefficients are matrices."""
    found = np.zeros((len(first) + len(second) - 1, *first.shape[1:]))
    for k, matrix in enumerate(first):
        found[k : k + len(second)] += matrix @ second
    return found
