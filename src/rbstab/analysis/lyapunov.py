"""The Lyapunov function along a motion, by part, and its audit."""

from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array


@dataclass(frozen=True, eq=False)
class LyapunovTrace:
    """v and v' along a motion.

    value and rate, shape (samples,), J and W; residual, shape (samples,), J, is
    r(t) = v(t) - v(0) - ∫v' dt, which is zero but for the errors of the integration.
    """

    value: Array
    rate: Array
    residual: Array


def lyapunov_trace(
    energy: Array, dissipation: Array, rate_integral: Array, energy_at_rest: float
) -> LyapunovTrace:
    """V = kinetic + stored energies - their value at rest, and v' = -(sum of dissipations).

    Eq. 28 to 31, 34, 42 and 45 are this sum for one set of elements each; eq. 29, 37, 43 and 46 are
    its derivative.

    Args:
        energy: By part, shape (samples, parts), J.
        dissipation: By part, shape (samples, parts), W.
        rate_integral: ∫v' dt, integrated together with the motion, shape (samples,), J.
        energy_at_rest: The stored energy of the rest state, J (the constant h of eq. 28, negative).
    """
    value = energy.sum(axis=1) - energy_at_rest
    return LyapunovTrace(value, -dissipation.sum(axis=1), value - value[0] - rate_integral)


AT_REST = 1e-4
"""A v(0) below this part of the energies that it is the sum of is little more than round-off."""


def relative_residual(residual: Array, value: Array, energy: Array) -> float:
    """The largest |r| over `audit_scale`.

    Args:
        residual: r, shape (samples,), J.
        value: v, shape (samples,), J.
        energy: By part, shape (samples, parts), J.
    """
    return float(np.abs(residual).max()) / audit_scale(value, energy)


def audit_scale(value: Array, energy: Array) -> float:
    """V(0), by which errors of v are measured, J.

    Where the motion starts at rest, a ten thousandth of the largest energy part instead; 1 J where
    there is no energy at all.

    Args:
        value: v, shape (samples,), J.
        energy: By part, shape (samples, parts), J.
    """
    return max(float(value[0]), AT_REST * float(np.abs(energy).max())) or 1.0
