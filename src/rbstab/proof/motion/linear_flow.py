"""The linear part of a step: polynomials near the fundamental matrix, and bounds on what they miss.

Small differences follow e' = Je, with a polynomial J in τ. Φ and Ψ are polynomials in τ with
matrices of doubles as coefficients: Φ is near the fundamental matrix, Ψ near its inverse. They are
exact as they are; only their defects are bounded.

All arrays may have further axes in front: then there is one motion for each of their entries.
"""

from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.bounds import inverses
from rbstab.proof.motion.rounding import error_of_inverse, error_of_products, rounded_up


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


def frames_of(matrices: Array) -> Frame:
    """Return frames, shape (..., n, n); errors are infinite where no inverse is proved."""
    identity = np.eye(matrices.shape[-1])
    usable = np.where(np.isfinite(matrices).all(axis=(-2, -1), keepdims=True), matrices, identity)
    # Without an inverse, zeros: then none is proved.
    flat = np.nan_to_num(inverses(np.moveaxis(usable.reshape(-1, *identity.shape), 0, 2)))
    inverse = np.moveaxis(flat, 2, 0).reshape(matrices.shape)
    return Frame(matrices, inverse, error_of_inverse(matrices, inverse))


@dataclass(frozen=True, eq=False)
class LinearFlow:
    """J, Φ and Ψ of a step: the coefficients of τᵏ, shape (..., terms, n, n)."""

    J: Array
    forward: Array
    backward: Array

    def last_term(self, scale: Array) -> Array:
        """Return the norm of the last term of Φ, in scaled states; NaN if it is not finite."""
        term = self.forward[..., -1, :, :] / scale[..., np.newaxis] * scale
        norm: Array = np.sqrt((term * term).sum(axis=(-2, -1)))
        return norm


def linear_flow(J: Array) -> LinearFlow:
    """Return polynomials near the solutions of Φ' = JΦ and Ψ' = -ΨJ from the identity."""
    terms = J.shape[-3]
    forward, backward = (np.zeros((*J.shape[:-3], terms + 1, *J.shape[-2:])) for _ in range(2))
    forward[..., 0, :, :] = backward[..., 0, :, :] = np.eye(J.shape[-1])
    for k in range(terms):
        rates = J[..., : k + 1, :, :][..., ::-1, :, :]  # highest first
        growth = (rates @ forward[..., : k + 1, :, :]).sum(axis=-3)
        decay = (backward[..., : k + 1, :, :] @ rates).sum(axis=-3)
        forward[..., k + 1, :, :] = growth / (k + 1)
        backward[..., k + 1, :, :] = -decay / (k + 1)
    return LinearFlow(J, forward, backward)


@dataclass(frozen=True, eq=False)
class LinearBounds:
    """Bounds for 0 <= τ <= 1, each of shape (..., n, n).

    Attributes:
        residual: On |Q⁻¹| ∫|Ψ' + ΨJ|, with each power of τ by itself.
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
    """Bound ∫|Ψ' + ΨJ| over 0 <= τ <= 1, each power of τ by itself, shape (..., n, n)."""
    Psi, terms = flow.backward, flow.J.shape[-3]
    coefficients, size = _product(Psi, flow.J), _product(np.abs(Psi), np.abs(flow.J))
    derivative = Psi[..., 1:, :, :] * _powers(Psi.shape[-3] - 1)
    coefficients[..., :terms, :, :] += derivative
    size[..., :terms, :, :] += np.abs(derivative)
    bound = np.abs(coefficients) + error_of_products(size)
    # The integral of τᵏ is at most 1/(k + 1).
    residual: Array = rounded_up((bound / _powers(bound.shape[-3])).sum(axis=-3))
    return residual


def _powers(count: int) -> Array:
    """Return 1, 2, ..., one for each coefficient."""
    return np.arange(1, count + 1)[:, np.newaxis, np.newaxis]


def _product(first: Array, second: Array) -> Array:
    """Multiply two polynomials whose coefficients are matrices."""
    terms, more = first.shape[-3], second.shape[-3]
    product = np.zeros((*first.shape[:-3], terms + more - 1, *first.shape[-2:]))
    for k in range(terms):
        product[..., k : k + more, :, :] += first[..., k : k + 1, :, :] @ second
    return product


def turned_frames(
    matrix: Array, error: Array, frame: Frame, radii: tuple[Array, Array], scale: Array
) -> tuple[Array, Array]:
    """Return new frames, and radii in them, of all MQw + r with |w| <= W and |r| <= `apart`.

    Args:
        matrix: Shape (..., n, n), near M.
        error: A bound on the distance of M.
        frame: Q.
        radii: W and `apart`, each of shape (..., n).
        scale: The size of each state, shape (n,).
    """
    Q_size, W, apart = np.abs(frame.matrix), *(part[..., np.newaxis] for part in radii)
    moved = matrix @ frame.matrix
    moved_error = error_of_products(np.abs(matrix) @ Q_size) + rounded_up(error @ Q_size)
    new = frames_of(_frame(moved * np.swapaxes(W, -2, -1), scale))
    turned = np.abs(new.inverse @ moved) + error_of_products(np.abs(new.inverse) @ np.abs(moved))
    turned = rounded_up(turned + new.error @ np.abs(moved))
    beside = rounded_up(moved_error @ W + apart)
    radius: Array = rounded_up(turned @ W + new.inverse_size @ beside)[..., 0]
    return new.matrix, radius


def _frame(edges: Array, scale: Array) -> Array:
    """Return a frame: orthonormal in scaled states, its first axis along the longest edge."""
    scaled = edges / scale[..., np.newaxis]
    scaled = np.where(np.isfinite(scaled), scaled, 0.0)
    lengths = np.linalg.norm(scaled, axis=-2)
    order = np.argsort(-lengths, axis=-1, kind="stable")[..., np.newaxis, :]
    unit = scaled / np.maximum(lengths, 1e-300)[..., np.newaxis, :]
    orthonormal, _ = np.linalg.qr(np.take_along_axis(unit, order, axis=-1))
    framed: Array = scale[..., np.newaxis] * orthonormal
    return framed
