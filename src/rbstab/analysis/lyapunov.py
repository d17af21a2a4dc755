"""The Lyapunov function along a motion, by part, and the check of its energy balance."""

import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System


def lyapunov_trace(
    energy: Array, rate_integral: Array, energy_at_rest: float
) -> tuple[Array, Array]:
    """Return v and its residual r(t) = v(t) - v(0) - ∫v' dt along a motion, shape (samples,), J.

    v is `systems.quantities.total_energy` less its value at rest. r is zero but for integration
    errors.

    Args:
        energy: By part, shape (samples, parts), J.
        rate_integral: ∫v' dt, integrated together with the motion, shape (samples,), J.
        energy_at_rest: The stored energy of the rest state, J (-h in eq. 28).
    """
    # numpy's order of the sum: with another, v of more than eight parts has other last bits.
    value = energy.sum(axis=1) - energy_at_rest
    return value, value - value[0] - rate_integral


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
