"""The linear part of a step: polynomials near the fundamental matrix, and bounds on what they miss.

Along the polynomial p of a step of length h, with J = ∂f/∂y and τ = t/h, small differences follow
e' = hJe. Φ and Ψ are polynomials in τ with matrices of doubles as coefficients: Φ is near the
fundamental matrix, Ψ near its inverse. They are exact as they are; only their defects are bounded.

All arrays may have further axes in front: then there is one motion for each of their entries.
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
    return Frame(matrix, inverse, error) if np.isfinite(error).all() else None


def frames_of(matrices: Array) -> Frame:
    """Return many frames, shape (..., n, n); errors are infinite where no inverse is proved."""
    identity = np.eye(matrices.shape[-1])
    finite = np.isfinite(matrices).all(axis=(-2, -1), keepdims=True)
    usable = np.where(finite, matrices, identity)
    try:
        inverse = np.linalg.inv(usable)
    except np.linalg.LinAlgError:  # one of them is singular: then each by itself
        found = [frame_of(one) for one in usable.reshape(-1, *identity.shape)]
        inverses = [identity if one is None else one.inverse for one in found]
        inverse = np.array(inverses).reshape(matrices.shape)
    return Frame(matrices, inverse, error_of_inverse(matrices, inverse))


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
        magnitude = np.abs(self.forward).sum(axis=-3)
        return self.forward.sum(axis=-3), error_of_products(magnitude)

    def last_term(self, scale: Array) -> Array:
        """Return the norm of the last term of Φ, in scaled states; infinite if it is not finite."""
        term = self.forward[..., -1, :, :] / scale[..., np.newaxis] * scale[..., np.newaxis, :]
        finite = np.asarray(np.isfinite(term).all(axis=(-2, -1)))
        usable = np.where(finite[..., np.newaxis, np.newaxis], term, 0.0)
        return np.where(finite, np.linalg.norm(usable, 2, axis=(-2, -1)), np.inf)


def linear_flow(J: JacobianSeries, h: float) -> LinearFlow:
    """Return polynomials near the solutions of Φ' = hJΦ and Ψ' = -hΨJ from the identity."""
    terms, n = J.middle.shape[-3:-1]
    middle = np.moveaxis(J.middle, -3, 0)
    identity = np.broadcast_to(np.eye(n), middle.shape[1:])
    forward, backward = [identity], [identity]
    for k in range(terms):
        growth = sum(middle[j] @ forward[k - j] for j in range(k + 1))
        decay = sum(backward[k - j] @ middle[j] for j in range(k + 1))
        forward.append(h / (k + 1) * growth)
        backward.append(-h / (k + 1) * decay)
    return LinearFlow(h, J, np.stack(forward, axis=-3), np.stack(backward, axis=-3))


@dataclass(frozen=True, eq=False)
class LinearBounds:
    """Bounds for 0 <= τ <= 1, each of shape (n, n).

    Attributes:
        residual: On |Q⁻¹| ∫|Ψ' + hΨJ|, with each power of τ by itself.
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
    Q, inverse = frame.matrix[..., np.newaxis, :, :], frame.inverse[..., np.newaxis, :, :]
    Phi_size, Psi_size = np.abs(Phi), np.abs(Psi)
    directed = np.abs(inverse @ Psi) + error_of_products(np.abs(inverse) @ Psi_size)
    forward = np.abs(Phi @ Q) + error_of_products(Phi_size @ np.abs(Q))
    product, size = _product(Phi, Psi), _product(Phi_size, Psi_size)
    identity = np.eye(Phi.shape[-1])
    product[..., 0, :, :] -= identity
    size[..., 0, :, :] += identity
    mismatch = np.abs(product) + error_of_products(size)
    return LinearBounds(
        residual=rounded_up(frame.inverse_size @ _residual(flow)),
        backward=rounded_up(directed.sum(axis=-3) + frame.error @ Psi_size.sum(axis=-3)),
        forward=rounded_up(forward.sum(axis=-3)),
        mismatch=rounded_up(mismatch.sum(axis=-3)),
    )


def _residual(flow: LinearFlow) -> Array:
    """Bound ∫|Ψ' + hΨJ| over 0 <= τ <= 1, each power of τ by itself, shape (n, n)."""
    Psi, J, h = flow.backward, flow.J, flow.h
    terms, Psi_size = J.middle.shape[-3], np.abs(Psi)
    coefficients, size = h * _product(Psi, J.middle), h * _product(Psi_size, np.abs(J.middle))
    derivative = Psi[..., 1:, :, :] * _powers(Psi.shape[-3] - 1)
    coefficients[..., :terms, :, :] += derivative
    size[..., :terms, :, :] += np.abs(derivative)
    bound = np.abs(coefficients) + error_of_products(size)
    # The integral of τᵏ is at most 1/(k + 1).
    bound = (bound / _powers(bound.shape[-3])).sum(axis=-3)
    # What is not in `middle`: the errors of the coefficients, and all further terms.
    missing = h * Psi_size.sum(axis=-3) @ (J.radius.sum(axis=-3) + J.rest)
    residual: Array = rounded_up(bound + missing)
    return residual


def _powers(count: int) -> Array:
    """Return 1, 2, ..., one for each coefficient."""
    return np.arange(1, count + 1)[:, np.newaxis, np.newaxis]


def _product(first: Array, second: Array) -> Array:
    """Multiply two polynomials whose coefficients are matrices."""
    terms, more = first.shape[-3], second.shape[-3]
    found = np.zeros((*first.shape[:-3], terms + more - 1, *first.shape[-2:]))
    for k in range(terms):
        found[..., k : k + more, :, :] += first[..., k : k + 1, :, :] @ second
    return found
