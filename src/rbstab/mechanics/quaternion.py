"""The attitude of the body as a quaternion q = (w, r) of any length, and its Euler angles."""

import math

import numpy as np

from rbstab.mechanics.numbers import Array, Number, cos, sin, square

PARTS = 16
"""An interval between samples near θ2 = ±90° is divided into this many."""


POLE = 1e-6
"""Where cos θ2 is smaller, θ1 and θ3 are not determined, but for their sum or difference."""


def quaternion(Theta: Array) -> tuple[Array, Array]:
    """Return the unit quaternion of A(Θ) (eq. 2).

    Args:
        Theta: Θ, shape (3,), or (3, ...) for many attitudes, rad.

    Returns:
        w, shape (1,), and r, shape (3,); or (1, ...) and (3, ...).
    """
    (s1, s2, s3), (c1, c2, c3) = sin(0.5 * Theta), cos(0.5 * Theta)
    x = s1 * c2 * c3 + c1 * s2 * s3
    y = c1 * s2 * c3 - s1 * c2 * s3
    z = c1 * c2 * s3 + s1 * s2 * c3
    return np.array([c1 * c2 * c3 - s1 * s2 * s3]), np.array([x, y, z])


def rotation(w: Number, r: Array) -> Array:
    """Return A = R(q)/q'q, shape (3, 3), from body to inertial coordinates: exact at any |q|."""
    x, y, z = r
    xx, yy, zz = square(x), square(y), square(z)
    s = 2.0 / (square(w) + xx + yy + zz)
    xy, xz, yz, wx, wy, wz = x * y, x * z, y * z, w * x, w * y, w * z
    return np.array(
        [
            [1.0 - s * (yy + zz), s * (xy - wz), s * (xz + wy)],
            [s * (xy + wz), 1.0 - s * (xx + zz), s * (yz - wx)],
            [s * (xz - wy), s * (yz + wx), 1.0 - s * (xx + yy)],
        ]
    )


def rate_matrix(w: Number, r: Array) -> Array:
    """Return ½(wI + ř), with ṙ = ½(wI + ř)Ω, the vector part of q̇ = ½ q⊗(0, Ω)."""
    x, y, z = 0.5 * r
    w = 0.5 * w
    return np.array([[w, -z, y], [z, w, -x], [-y, x, w]])


def angles(w: Array, r: Array) -> tuple[Array, Array]:
    """Return Θ of attitudes, shape (3, ...), rad, and cos θ2: |θ1|, |θ3| <= π and |θ2| <= π/2.

    θ3 belongs to this θ1, so A(Θ) is the attitude also where θ2 is near ±90° and neither is sharp.

    Args:
        w: Shape (...).
        r: Shape (3, ...).
    """
    x, y, z = r
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    xy, xz, yz, wx, wy, wz = x * y, x * z, y * z, w * x, w * y, w * z
    # The entries of R(q), whose ratios alone count: s and c are q'q cos θ2 sin θ1 and cos θ1.
    s, c = 2.0 * (wx - yz), ww - xx - yy + zz
    upright = np.sqrt(s * s + c * c)
    c = np.where(upright == 0.0, 1.0, c)
    sine = 2.0 * (c * (xy + wz) + s * (xz - wy))
    cosine = c * (ww - xx + yy - zz) + 2.0 * s * (yz + wx)
    theta2 = np.arctan2(2.0 * (xz + wy), upright)
    Theta = np.array([np.arctan2(s, c), theta2, np.arctan2(sine, cosine)])
    return Theta, upright / (ww + xx + yy + zz)


def sharp_angles(w: Number, r: Array) -> Array:
    """Return Θ of one attitude as by `angles`, with θ3 = 0 where θ2 = ±90° and neither is sharp."""
    Theta, cosine = angles(w, r)
    if cosine < POLE:
        A = rotation(w, r)
        return np.array([math.atan2(A[2, 1], A[1, 1]), Theta[1], 0.0])
    return Theta


def turned_back(Theta: Array) -> Array:
    """Return Θ of the same attitude in the range of eq. 5, shape (3,), rad; as `sharp_angles`."""
    (w,), r = quaternion(Theta)
    return sharp_angles(w, r)


def continued_angles(  # noqa: PLR0913, PLR0917 (motions)
    w: Array, r: Array, Omega: Array, times: Array, first: Array, start: Array
) -> tuple[Array, Array]:
    """Return Θ along motions, whose θ1 and θ3 do not jump; and how far they turn in doubt.

    θ1 is the direction of (A33, -A23), and θ3 that of (A11, -A12). Both vectors are cos θ2 long. If
    this is more than the body turns between two samples, each takes the shorter way. Near
    θ2 = ±90° the way is that of the cubic through q and q̇. It is in doubt if cos θ2 is no larger
    there than the error of the cubic. The angles of a motion do not depend on the others, to the
    last bit: only whole turns are added up.

    Args:
        w: The samples of m motions, one after the other, shape (n,).
        r: Shape (3, n).
        Omega: Ω, shape (3, n), rad/s, body.
        times: Shape (n,), s.
        first: The first sample of each motion, shape (m,).
        start: Θ there, with any whole turns, shape (3, m), rad.

    Returns:
        Θ, shape (3, n), rad; and the largest angle by which the body turns between two samples of
        each motion where the way is in doubt, shape (m,), rad, else 0.
    """
    Theta, upright = angles(w, r)
    lengths, speed = np.diff(times), np.sqrt((Omega * Omega).sum(axis=0))
    turn = lengths * np.maximum(speed[1:], speed[:-1])
    # The vectors bend off their chord by at most turn²/8 if Ω is steady; twice that is allowed for.
    near = ~(np.minimum(upright[1:], upright[:-1]) > turn * (0.5 + 0.25 * turn))
    near[first[1:] - 1] = False
    motion = np.concatenate([w[np.newaxis], r, Omega])
    parts, least = _ways(motion[:, :-1][:, near], motion[:, 1:][:, near], lengths[near])
    jumps = np.zeros((2, len(times)))
    jumps[:, 1:] = -np.diff(Theta[::2])
    jumps[:, 1:][:, near] += parts.sum(axis=1)
    # An angle that is no number hides no turn of the next motion.
    turns = np.cumsum(np.nan_to_num(_turns(jumps)), axis=1)
    turns_at_start = _turns((start - Theta[:, first])[::2])
    counts = np.diff(np.append(first, len(times)))
    turns += np.repeat(turns_at_start - turns[:, first], counts, axis=1)
    Theta[::2] += 2.0 * math.pi * turns
    # A steady turn α of the body is α⁴/3072 off the cubic; fifteen times that is allowed for.
    doubt = np.zeros(len(times))
    doubt[:-1][near] = np.where(least > turn[near] ** 4 / 200.0, 0.0, turn[near])
    return Theta, np.maximum.reduceat(doubt, first)


def turning(w: Array, r: Array, Omega: Array) -> Array:
    """Return θ1, sin θ2 and θ3, and their rates, shape (2, 3, ...).

    Only sin θ2 is smooth at θ2 = ±90°. θ1 and θ3 are those of `angles`.

    Args:
        w: Shape (...).
        r: Shape (3, ...).
        Omega: Ω, shape (3, ...), rad/s, body.
    """
    Theta, upright = angles(w, r)
    sine, s, c = np.sin(Theta[1]), np.sin(Theta[2]), np.cos(Theta[2])
    first = (c * Omega[0] - s * Omega[1]) / upright
    rates = [first, upright * (s * Omega[0] + c * Omega[1]), Omega[2] - sine * first]
    return np.array([[Theta[0], sine, Theta[2]], rates])


def beyond_ends(before: Array, after: Array, lengths: Array) -> Array:
    """Return how far θ1 and θ3 go beyond both their ends in k steps near θ2 = ±90°, (2, k), rad.

    Args:
        before: w, r and Ω at the begin of each step, shape (7, k).
        after: The same at its end.
        lengths: Shape (k,), s.
    """
    path = np.cumsum(_ways(before, after, lengths)[0], axis=1)
    end = path[:, -1]
    over = path.max(axis=1, initial=0.0) - np.maximum(end, 0.0)
    under = np.minimum(end, 0.0) - path.min(axis=1, initial=0.0)
    return np.asarray(np.maximum(over, under))


def same_turns(Theta: Array, reference: Array) -> Array:
    """Return Θ with the whole turns of θ1 and θ3 that are nearest to a reference, shape (3, n)."""
    turned = Theta.copy()
    turned[::2] += 2.0 * math.pi * _turns((reference - Theta)[::2])
    return turned


def _turns(angles: Array) -> Array:
    """Return the nearest numbers of whole turns."""
    return np.round(angles / (2.0 * math.pi))


def _ways(before: Array, after: Array, h: Array) -> tuple[Array, Array]:
    """Return how far θ1 and θ3 go in the parts of k intervals, (2, PARTS, k); the least cos θ2."""
    a, b, up, down = before[:4], after[:4], _rates(before), _rates(after)
    s = np.linspace(0.0, 1.0, PARTS + 1)[:, np.newaxis, np.newaxis]
    t = 1.0 - s
    cubic = t * t * ((1 + 2 * s) * a + s * h * up) + s * s * ((1 + 2 * t) * b - t * h * down)
    Theta, upright = angles(cubic[:, 0], np.moveaxis(cubic[:, 1:], 1, 0))
    parts = np.diff(Theta[::2], axis=1)
    return parts - 2.0 * math.pi * _turns(parts), upright.min(axis=0)


def _rates(motion: Array) -> Array:
    """Return q̇ = ½ q⊗(0, Ω), shape (4, k), of q and Ω, shape (7, k)."""
    w, r, Omega = motion[0], motion[1:4], motion[4:]
    return 0.5 * np.concatenate(
        [-(r * Omega).sum(axis=0)[np.newaxis], w * Omega + np.cross(r, Omega, axis=0)]
    )
