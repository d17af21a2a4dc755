"""The rest states of a body that is not held, with an energy that is not quadratic in X."""

from rbstab.analysis.configuration import configurations
from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy
from rbstab.analysis.proof.traced.separate import user_energies
from rbstab.proof.model import ExactSystem
from rbstab.proof.rest_states import Body
from rbstab.systems.system import System

BOX_LIMIT, BRIEF_BOX_LIMIT = 100_000, 4_000
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
