"""The Lyapunov function along a motion, by part, and the check of its energy balance."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array


@dataclass(frozen=True, eq=False)
class LyapunovTrace:
    """v and v' along a motion.

    value and rate have shape (samples,), J and W. residual, shape (samples,), J, is
    r(t) = v(t) - v(0) - ∫v' dt. Without integration errors it would be zero.
    """

    value: Array
    rate: Array
    residual: Array


def lyapunov_trace(
    energy: Array,
    dissipation: Array,
    rate_integral: Array,
    energy_at_rest: float,
    supplied: Array | None = None,
) -> LyapunovTrace:
    """Compute v = kinetic + stored energies - their value at rest, and v' = -(sum of dissipations).

    Eq. 28 to 31, 34, 42 and 45 are this sum, each for one set of elements. Eq. 29, 37, 43 and 46
    are its derivative. Where elements supply power, v' is the sum of what they supply minus the sum
    of dissipations.

    Args:
        energy: By part, shape (samples, parts), J.
        dissipation: By part, shape (samples, parts), W.
        rate_integral: ∫v' dt, integrated together with the motion, shape (samples,), J.
        energy_at_rest: The stored energy of the rest state, J (-h in eq. 28).
        supplied: The power that is supplied, by part, shape (samples, parts), W; None if none is.
    """
    value, rate = energy.sum(axis=1) - energy_at_rest, -dissipation.sum(axis=1)
    if supplied is not None:
        rate = supplied.sum(axis=1) + rate
    return LyapunovTrace(value, rate, value - value[0] - rate_integral)


MIN_START_FRACTION = 1e-4
"""If v(0) is below this fraction of the largest energy part, it has lost digits to round-off."""


def relative_residual(
    residual: Array, value: Array, energy: Array, supplied: Array | None = None
) -> float:
    """Return the largest |r| divided by `audit_scale`.

    Args:
        residual: r, shape (samples,), J.
        value: v, shape (samples,), J.
        energy: By part, shape (samples, parts), J.
        supplied: What is supplied up to each sample, shape (samples,), J; None if nothing is.
    """
    return float(np.abs(residual).max()) / audit_scale(value, energy, supplied)


class Scale(NamedTuple):
    """An energy, J, by which errors of v are divided, and what it is, in words."""

    energy: float
    name: str


def audit_scale(value: Array, energy: Array, supplied: Array | None = None) -> float:
    """Return the energy by which errors of v are divided, J, see `named_scale`."""
    return named_scale(value, energy, supplied).energy


def named_scale(value: Array, energy: Array, supplied: Array | None = None) -> Scale:
    """Return the energy by which errors of v are divided, with its name.

    It is v(0), or a ten thousandth of the largest energy part if that is larger, as for a motion
    that starts close to the rest state, or what is supplied if that is larger. If there is no
    energy at all, it is 1 J. In stored certificates all of them are called v(0).

    Args:
        value: v, shape (samples,), J.
        energy: By part, shape (samples, parts), J.
        supplied: What is supplied up to each sample, shape (samples,), J; None if nothing is.
    """
    most = 0.0 if supplied is None else float(np.abs(supplied).max())
    largest = MIN_START_FRACTION * float(np.abs(energy).max())
    scales = (
        Scale(float(value[0]), "v(0)"),
        Scale(largest, f"({MIN_START_FRACTION:g} of the largest energy)"),
        Scale(most, "largest supplied energy"),
    )
    found = max(scales, key=lambda scale: scale.energy)
    return found if found.energy else Scale(1.0, "1 J")
