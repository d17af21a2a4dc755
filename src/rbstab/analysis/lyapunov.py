"""The Lyapunov function along a motion, by part, and the check of its energy balance."""

from dataclasses import dataclass

import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System


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


ENERGY_SCALE = "largest energy"
"""The name of `energy_scale`."""

DIGITS = 1e8
"""An energy scale is at least this many times the round-off of v: below it, v has few digits."""

ENERGY_SCALE_NOTE = (
    f"The {ENERGY_SCALE} is the largest |v| or supplied energy of the motion; or {DIGITS:g} times "
    "the round-off of v if that is larger, as for a start close to a rest state under a load."
)


def energy_scale(value: Array, round_off: Array | float, supplied: Array | None = None) -> Array:
    """Return the energy by which errors of v are divided, shape (...), J; it is never zero.

    It is the largest |v| along the motion, or the largest supplied energy if that is larger. For
    motions close to a rest state under a load it is at least `DIGITS` times the round-off of v.

    Args:
        value: v, shape (..., samples), J.
        round_off: `settling.value_round_off`, shape (...), J.
        supplied: What is supplied up to each sample, shape (..., samples), J; None if nothing is.
    """
    largest = _largest(value)
    if supplied is not None:
        largest = np.maximum(largest, _largest(supplied))
    return np.maximum(largest, DIGITS * np.asarray(round_off))


def _largest(energy: Array) -> Array:
    """Return the largest finite |energy| of the samples: v of a diverged motion overflows."""
    return np.abs(np.where(np.isfinite(energy), energy, 0.0)).max(axis=-1)


def has_no_potential(system: System) -> bool:
    """Whether the contact force has no potential energy, as for s = F + κE."""
    sliding = [e for e in system.elements if isinstance(e, SlidingConnector)]
    return bool(sliding) and sliding[0].rate_weight != 0.0
