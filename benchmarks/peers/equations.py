"""The equations of the benchmark problem, as a plain script of a user, for several array modules.

rbstab states its equations once, in `rbstab.mechanics`. This file repeats them on purpose: it is
what a user of numpy, numba or jax would write, and it must run where rbstab is not installed.
rbstab never uses it. Each run of the benchmark compares its motions with those of rbstab, so the
two also check each other.

The problem is the body of the paper's Case 2, with a visco-elastic connector at its contact point.
The inertia and the gains are diagonal. The state is [Θ, Ω, X, V]: Euler angles, rad; angular
velocity, rad/s, body; position and velocity of the centre of gravity, m and m/s, inertial. The body
turns about its axes 1, 2 and 3 in this order: A = A1(θ1) A2(θ2) A3(θ3).

All vectors are written out in components. For numpy this is twice as fast as 3-vectors and 3x3
matrices; for numba and jax it makes little difference.
"""

from collections.abc import Callable, Mapping
from typing import Any

Array = Any
Function = Callable[..., Any]


def _as_it_is(function: Function) -> Function:
    return function


def make_forces(
    problem: Mapping[str, Any], compiled: Callable[[Function], Function] = _as_it_is
) -> Function:
    """Return the function of the force and the couple on the body.

    Args:
        problem: `contact_point` and the gains by name, each a list of three numbers.
        compiled: Compiles a function (numba), or returns it as it is.

    Returns:
        A function of the sines and the cosines of Θ, and of the state. It returns the force on the
        centre of gravity, N, inertial, and the couple about it, N m, body: six numbers.
    """
    (r1, r2, r3), (kr1, kr2, kr3), (lr1, lr2, lr3) = (
        problem[name] for name in ("contact_point", "K_r", "L_r")
    )
    (kt1, kt2, kt3), (lt1, lt2, lt3) = problem["K_t"], problem["L_t"]
    (kc1, kc2, kc3), (lc1, lc2, lc3) = problem["K_c"], problem["L_c"]

    def forces(sines: Array, cosines: Array, state: Array) -> tuple[Any, ...]:
        (s1, s2, s3), (c1, c2, c3) = sines, cosines
        a1, a2, a3, p, q, r, x1, x2, x3, v1, v2, v3 = state
        # The rotation A from body to inertial coordinates.
        A11, A12, A13 = c2 * c3, -c2 * s3, s2
        A21, A22, A23 = c1 * s3 + s1 * s2 * c3, c1 * c3 - s1 * s2 * s3, -s1 * c2
        A31, A32, A33 = s1 * s3 - c1 * s2 * c3, s1 * c3 + c1 * s2 * s3, c1 * c2
        # The contact point: its displacement E = X + AR - R, and its velocity F = V + A(Ω × R).
        w1, w2, w3 = q * r3 - r * r2, r * r1 - p * r3, p * r2 - q * r1
        e1 = x1 + A11 * r1 + A12 * r2 + A13 * r3 - r1
        e2 = x2 + A21 * r1 + A22 * r2 + A23 * r3 - r2
        e3 = x3 + A31 * r1 + A32 * r2 + A33 * r3 - r3
        f1 = v1 + A11 * w1 + A12 * w2 + A13 * w3
        f2 = v2 + A21 * w1 + A22 * w2 + A23 * w3
        f3 = v3 + A31 * w1 + A32 * w2 + A33 * w3
        # The force of the connector, inertial (h) and body (g).
        h1, h2, h3 = -kc1 * e1 - lc1 * f1, -kc2 * e2 - lc2 * f2, -kc3 * e3 - lc3 * f3
        g1 = A11 * h1 + A21 * h2 + A31 * h3
        g2 = A12 * h1 + A22 * h2 + A32 * h3
        g3 = A13 * h1 + A23 * h2 + A33 * h3
        # The rotational spring acts on the Euler angles; on the body its couple is -B'(Θ) K_r Θ.
        b1, b2, b3 = kr1 * a1, kr2 * a2, kr3 * a3
        turn = (b1 - s2 * b3) / c2
        return (
            h1 - kt1 * x1 - lt1 * v1,
            h2 - kt2 * x2 - lt2 * v2,
            h3 - kt3 * x3 - lt3 * v3,
            -c3 * turn - s3 * b2 - lr1 * p + r2 * g3 - r3 * g2,
            s3 * turn - c3 * b2 - lr2 * q + r3 * g1 - r1 * g3,
            -b3 - lr3 * r + r1 * g2 - r2 * g1,
        )

    return compiled(forces)


def make_rates(
    xp: Any, problem: Mapping[str, Any], compiled: Callable[[Function], Function] = _as_it_is
) -> Function:
    """Return the right-hand side (t, y) -> dy/dt of the state y = [Θ, Ω, X, V], shape (12,).

    Args:
        xp: The array module: numpy or jax.numpy.
        problem: `mass` in kg, `inertia` (principal moments) in kg m², and as in `make_forces`.
        compiled: As in `make_forces`.
    """
    mass, (j1, j2, j3) = problem["mass"], problem["inertia"]
    array, sin, cos = xp.array, xp.sin, xp.cos
    forces = make_forces(problem, compiled)

    def rates(t: float, y: Array) -> Array:  # noqa: ARG001 (solve_ivp and diffrax pass the time)
        sines, cosines = sin(y[0:3]), cos(y[0:3])
        (_, s2, s3), (_, c2, c3) = sines, cosines
        _, _, _, p, q, r, _, _, _, v1, v2, v3 = y
        force1, force2, force3, couple1, couple2, couple3 = forces(sines, cosines, y)
        turn = (c3 * p - s3 * q) / c2
        return array(
            [
                turn,
                s3 * p + c3 * q,
                r - s2 * turn,
                (couple1 - (j3 - j2) * q * r) / j1,
                (couple2 - (j1 - j3) * r * p) / j2,
                (couple3 - (j2 - j1) * p * q) / j3,
                v1,
                v2,
                v3,
                force1 / mass,
                force2 / mass,
                force3 / mass,
            ]
        )

    return compiled(rates)


def rotation_of(xp: Any, Theta: Array) -> Array:
    """Return A(Θ), shape (3, 3), from body to inertial coordinates."""
    (s1, s2, s3), (c1, c2, c3) = xp.sin(Theta), xp.cos(Theta)
    return xp.array(
        [
            [c2 * c3, -c2 * s3, s2],
            [c1 * s3 + s1 * s2 * c3, c1 * c3 - s1 * s2 * s3, -s1 * c2],
            [s1 * s3 - c1 * s2 * c3, s1 * c3 + c1 * s2 * s3, c1 * c2],
        ]
    )


def angles_of(xp: Any, A: Array) -> Array:
    """Return Θ of a rotation A, each within ±π; the inverse of `rotation_of`."""
    return xp.array(
        [
            xp.arctan2(-A[1, 2], A[2, 2]),
            xp.arcsin(A[0, 2]),
            xp.arctan2(-A[0, 1], A[0, 0]),
        ]
    )
