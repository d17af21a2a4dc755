"""The power balance of an element: what it stores, what it dissipates, and what its wrench gives.

For every motion of the body, stored' + dissipated = -(f'V + c'Ω + Λ'F), with the force f, the
couple c and the contact force Λ of the wrench. In stored' the own states have the stated rates. So
v falls by what is dissipated, as the theorem needs.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rbstab.experiment.element_check.states import Sample, own_in
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import Wrench
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA, V_OF_Z, X_OF_Z

TOLERANCE = 1e-12
"""The largest error of a balance, relative to the sum of the sizes of its terms."""

_TURN, _MOVE = (
    "a turn of 1 rad/s about the body axis",
    "a velocity of 1 m/s along the inertial axis",
)

DIRECTIONS = (
    *((f"{_TURN} {axis}", OMEGA, k) for k, axis in enumerate("xyz")),
    *((f"{_MOVE} {axis}", V_OF_Z, k) for k, axis in enumerate("xyz")),
)
"""Velocities of the body, each with its slice of Z and its index in it."""


class Powers(NamedTuple):
    """The powers of an element at a state, W.

    Attributes:
        stored: The rate of the stored energy.
        dissipated: The power that it dissipates.
        given: The power of its wrench on the body.
        size: The sum of the sizes of all terms.
    """

    stored: float
    dissipated: float
    given: float
    size: float

    @property
    def error(self) -> float:
        """The sum of the three, which must be zero."""
        return self.stored + self.dissipated + self.given

    @property
    def balances(self) -> bool:
        """Whether it is zero but for round-off."""
        return abs(self.error) <= TOLERANCE * self.size


def problems_at_rest(sample: Sample) -> Iterator[str]:
    """Yield where the wrench on a body at rest is not the slope of the stored energy."""
    resting = sample.y.copy()
    resting[OMEGA] = resting[V_OF_Z] = 0.0
    wrench, slopes = wrench_at(sample, resting), stored_slopes(sample, resting)
    found: dict[str, Powers] = {}
    for words, place, index in DIRECTIONS:
        moving = resting.copy()
        moving[place][index] = 1.0
        found[words] = _powers(sample, moving, wrench, slopes)
    words, worst = max(found.items(), key=lambda item: abs(item[1].error))
    if any(not powers.balances for powers in found.values()):
        yield (
            f"the wrench on a body at rest is not the slope of `stored`: with {words}, `stored` "
            f"changes by {worst.stored:.6g} W, and `wrench` gives {worst.given:.6g} W to the body "
            "(their sum must be 0)"
        )


def problems_in_motion(sample: Sample) -> Iterator[str]:
    """Yield where the power balance of a moving body fails, or the dissipation is negative."""
    dissipated = float(sample.element.dissipated(sample.motion, sample.own))
    wrench, slopes = wrench_at(sample, sample.y), stored_slopes(sample, sample.y)
    rates = sample.element.rates(sample.motion, sample.own)
    found = _powers(sample, sample.y, wrench, slopes, dissipated, rates)
    if not found.balances:
        blamed = ", or `rates` is wrong" if sample.element.state_size else ""
        yield (
            f"`dissipated` is not the power that `wrench` takes from the motion{blamed}: `stored` "
            f"changes by {found.stored:.6g} W, `dissipated` is {found.dissipated:.6g} W, and "
            f"`wrench` gives {found.given:.6g} W to the body (their sum must be 0, and is "
            f"{found.error:.6g} W)"
        )
    if not dissipated >= -TOLERANCE * found.size:
        yield f"`dissipated` is negative: {dissipated:.6g} W; such an element is not passive"


def problems_of_velocities(sample: Sample) -> Iterator[str]:
    """Yield where the stored energy depends on velocities."""
    slopes = stored_slopes(sample, sample.y)
    for name, place in (("Ω", OMEGA), ("V", V_OF_Z)):
        if np.any(slopes[place] != 0.0):
            yield f"`stored` depends on the velocity {name}; only the body has kinetic energy"


def _powers(  # noqa: PLR0913, PLR0917 (all that the powers depend on)
    sample: Sample,
    y: Array,
    wrench: Wrench,
    slopes: Array,
    dissipated: float = 0.0,
    own_rates: Array | float = 0.0,
) -> Powers:
    """Return the powers of a wrench along the motion at a state, with all accelerations zero.

    Args:
        sample: The system.
        y: The state, whose velocities are those of the motion.
        wrench: The wrench.
        slopes: The derivatives of the stored energy by the entries of the state.
        dissipated: The dissipated power, W.
        own_rates: The rates of the own states; by default these are at rest.
    """
    motion = sample.system.motion(y)
    rates = np.zeros(len(y))
    rates[THETA], rates[X_OF_Z] = motion.B @ motion.Omega, motion.V
    rates[sample.system.coordinates.size :] = own_rates
    stored = float(slopes @ rates)
    terms = np.concatenate(
        [
            wrench.force * motion.V,
            wrench.couple * motion.Omega,
            wrench.contact_force * motion.F,
        ]
    )
    size = np.abs(slopes * rates).sum() + np.abs(terms).sum() + abs(dissipated)
    return Powers(stored, dissipated, float(terms.sum()), float(size) + np.finfo(float).tiny)


def stored_slopes(sample: Sample, y: Array) -> Array:
    """Return the derivatives of the stored energy by the entries of y, by complex steps."""
    system = sample.system
    return jacobian(lambda z: sample.element.stored(system.motion(z), own_in(system, z)), y)


def wrench_at(sample: Sample, y: Array) -> Wrench:
    """Return the wrench of the element at a state, in the modes of the sample."""
    found: Wrench = sample.element.wrench(sample.system.motion(y), own_in(sample.system, y))
    return found
