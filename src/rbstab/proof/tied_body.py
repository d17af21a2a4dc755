"""The rest states of a body that is not held, with an energy that is not quadratic in X."""

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy
from rbstab.analysis.proof.traced.separate import user_energies
from rbstab.mechanics.numbers import Array
from rbstab.proof.confine import confined
from rbstab.proof.model import ExactSystem
from rbstab.proof.rest_states import Body, RestStates
from rbstab.systems.system import System

BOX_LIMIT, BRIEF_BOX_LIMIT = 100_000, 3_000
"""The number of boxes at which a search stops, and the same if nobody asked for the proof."""

KINKED = "its force jumps, and no proof takes such a force into account where X is not known"


class TiedBody(Body):
    """A body with springs, or elements of users whose energy is convex in X.

    Args:
        system: The system, in doubles; `reduced_energy` has found that its energy is not quadratic.
        exact_system: Builds the same in exact numbers, without elements of users.

    Raises:
        NoReducedEnergy: Its energy is in no proof; the error gives the reason.
    """

    def __init__(self, system: System, exact_system: ExactSystem) -> None:
        kinked = user_energies(configurations(system)).kinked
        if kinked:
            raise NoReducedEnergy(NoEnergyReason.NOT_IN_PROOFS, f"{kinked[0].name}: {KINKED}")
        self._trace(system, exact_system)
        if self.energy.stop is not None:
            raise NoReducedEnergy(NoEnergyReason.STOP_IN_SIX)

    @property
    def wide_limit(self) -> int:
        """The number of boxes at which the proof for all θ1 and θ3 stops."""
        return BOX_LIMIT

    def _possible(self, end: Array) -> Array:
        return end

    def wide(self, rest: RestStates, limit: int | None = None) -> RestStates | None:
        """Prove the rest states with |θ2| < π/2 and any θ1 and θ3, as `Body.wide` does."""
        ends = confined(self.energy, float(RANGE_END[1]))
        if ends is None:
            return None
        end = np.maximum(RANGE_END, [ends[0], RANGE_END[1], ends[1]])
        if np.array_equal(end, RANGE_END):
            return rest
        return self.proved(self.wide_limit if limit is None else limit, end, rest)
