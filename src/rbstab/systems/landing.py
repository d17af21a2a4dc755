"""What follows an impact against a stop: the modes of axes that slide, and whether the body rests.

The forces of ties are bounded, so they do nothing during an impact: the impulse is that on θ2
alone. It moves the points of the ties, and so each s = F + κE jumps. Axes that were held are thrown
off their surfaces, and arrive there again. No tie beside a stop sticks on s = E.

So a body that comes to rest makes hops, with axes that leave and arrive, all of them smaller and
smaller. With the rates r of some axes and of θ2, which are zero at rest, and their mobility W, the
hops have the energy T = ½ r'W⁻¹r: that of all velocities beside those at rest, in the metric of the
kinetic energy. At rest the couple λ presses. Neither the axes nor the impacts add to T + λh, with
the distance h from the stop: the force of an axis opposes its s more than that which would hold it.
So no later hop is higher than T/λ. Without axes this is θ̇2²/(2α).
"""

from contextlib import suppress

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import (
    Choice,
    RedundantTiesError,
    bounds_of_axes,
    choice,
    chosen,
    largest_couple,
    moved,
    near,
    residuals,
    resting,
    slide_modes,
    with_held,
)
from rbstab.systems.impact import HOP_HEIGHT, laid_on_stop
from rbstab.systems.modes import with_changed, with_contact
from rbstab.systems.system import System


def after_impact(system: System, y: Array, time: float = 0.0) -> tuple[System, Array]:
    """Return a system after an impact, and the state: each axis in the mode of its s.

    Axes that the impact has not moved are chosen as in `filippov`.

    Args:
        system: The system, in the modes before the impact; the body does not rest.
        y: The state after the impact, or the audited state.
        time: The time, s.

    Raises:
        RedundantTiesError: The forces that hold axes are not determined.
    """
    s = residuals(system, y)[:-1]
    moved_on = with_changed(system, slide_modes(system), [s > 0, np.zeros(len(s))])
    return chosen(moved_on, y, near(system, y), time)


def landed(system: System, y: Array, side: int, time: float = 0.0) -> tuple[System, Array] | None:
    """Return the system and the state of a body at rest against its stop; None if it hops on.

    It rests if some axes would be held beside it, or none, and no later hop would be higher than
    `HOP_HEIGHT`. Of all axes that are near enough to their surfaces, as many as possible take part.

    Args:
        system: The system after the impact (`after_impact`).
        y: The state, or the audited state.
        side: The side of the stop, 1 or -1.
        time: The time, s.
    """
    energies, most = _hops(system, y, time)
    limit = most * HOP_HEIGHT
    if energies[-1] > limit:
        return None
    rows = np.flatnonzero(energies[:-1] <= limit)
    # The axis with the most energy is the first one that does not take part.
    rows = rows[np.argsort(energies[rows], kind="stable")]
    touching = with_contact(system, side)
    for count in range(len(rows), -1, -1):
        with suppress(RedundantTiesError):
            decision = choice(touching, y, np.sort(rows[:count]), time)
            if resting(decision.system) and _hop_height(decision, y, time) <= HOP_HEIGHT:
                return decision.system, laid_on_stop(decision.system, moved(decision, y))
    return None


def _hops(system: System, y: Array, time: float) -> tuple[Array, float]:
    """Return the energy of the rate of each row alone, J, and a bound of the couple, N m."""
    K_s = bounds_of_axes(system)
    system, surfaces = with_held(system, y, np.arange(len(K_s)), time)
    energies = 0.5 * residuals(system, y) ** 2 / np.diag(surfaces.mobility)
    return energies, largest_couple(surfaces.mobility, surfaces.rates, K_s)


def _hop_height(decision: Choice, y: Array, time: float) -> float:
    """Return the largest height of later hops, rad: T/λ."""
    rows = decision.rows[decision.sides == 0]
    r = residuals(decision.system, y)[rows]
    energy = 0.5 * float(r @ np.linalg.solve(decision.surfaces.mobility[np.ix_(rows, rows)], r))
    _, pairs = decision.system.acting(y, time)
    couple = next(float(hold[0]) for element, hold in pairs if element.holds)
    return energy / abs(couple)
